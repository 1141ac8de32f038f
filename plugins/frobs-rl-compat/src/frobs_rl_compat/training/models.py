"""FRobs_RL's algorithms, each of which reads its own block of the YAML file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

from stable_baselines3.common.base_class import BaseAlgorithm

from frobs_core.util.errors import MissingSettingError
from frobs_rl_compat.training.basic_model import BasicModel
from frobs_rl_compat.training.building import imitated_model


class OnPolicyModel(BasicModel):
    """Base class of PPO and A2C, with two arguments in addition to those of :class:`BasicModel`.

    Args:
        *args: Positional arguments of :class:`BasicModel`.
        load_il_policy: Whether to start with the policy in ``il_policy_path``.
        il_policy_path: Model file that imitation learning with the same algorithm produced.
        **kwargs: Keyword arguments of :class:`BasicModel`.
    """

    def __init__(
        self, *args: Any, load_il_policy: bool = False, il_policy_path: Path | str | None = None, **kwargs: Any
    ) -> None:
        if load_il_policy and il_policy_path is None:
            raise MissingSettingError(
                "load_il_policy", "il_policy_path", "set il_policy_path to the model file from imitation learning"
            )
        self._il_policy = Path(il_policy_path) if load_il_policy and il_policy_path is not None else None
        super().__init__(*args, **kwargs)

    def _make(self) -> BaseAlgorithm:
        if self._il_policy is None:
            return super()._make()
        assert self.settings is not None
        return imitated_model(self.settings, self.env, self._il_policy, self._trust)


class A2C(OnPolicyModel):
    """Advantage actor-critic, configured by the ``a2c_params`` block of the YAML file."""

    algorithm: ClassVar[str] = "a2c"


class DDPG(BasicModel):
    """Deep deterministic policy gradient, configured by the ``ddpg_params`` block of the YAML file."""

    algorithm: ClassVar[str] = "ddpg"


class DQN(BasicModel):
    """Deep Q network, configured by the ``dqn_params`` block of the YAML file."""

    algorithm: ClassVar[str] = "dqn"


class PPO(OnPolicyModel):
    """Proximal policy optimization, configured by the ``ppo_params`` block of the YAML file."""

    algorithm: ClassVar[str] = "ppo"


class SAC(BasicModel):
    """Soft actor-critic, configured by the ``sac_params`` block of the YAML file."""

    algorithm: ClassVar[str] = "sac"


class TD3(BasicModel):
    """Twin delayed DDPG, configured by the ``td3_params`` block of the YAML file."""

    algorithm: ClassVar[str] = "td3"
