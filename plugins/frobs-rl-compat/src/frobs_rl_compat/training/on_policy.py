"""PPO and A2C, which can start with a policy from imitation learning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

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
        assert self.env is not None
        return imitated_model(self.settings, self.env, self._il_policy, self._trust)
