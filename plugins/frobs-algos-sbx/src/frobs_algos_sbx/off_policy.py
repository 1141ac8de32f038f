"""Off-policy algorithms from sbx."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import jax.numpy as jnp
import sbx
from pydantic import Field, PositiveInt, model_validator
from sbx.common.off_policy_algorithm import OffPolicyAlgorithmJax

from frobs_algos.settings import Widths
from frobs_algos_sb3.crossq import CrossQConfig
from frobs_algos_sb3.dqn import DQNConfig
from frobs_algos_sb3.networks import (
    BatchNormConfig,
    DeterministicConfig,
    QNetworkConfig,
    QuantileConfig,
    SquashedGaussianConfig,
)
from frobs_algos_sb3.sac import SACConfig
from frobs_algos_sb3.td3 import TD3Config
from frobs_algos_sb3.tqc import TQCConfig
from frobs_algos_sbx.algorithm import JaxOffPolicy
from frobs_algos_sbx.settings import JaxConfig, JaxNetworkConfig

_MEMORY = "optimize_memory_usage"
_EXPLORATION = ("use_sde", "sde_sample_freq", "use_sde_at_warmup")
_EXPLORATION_NETWORK = ("log_std_init", "use_expln", "clip_mean")
"""Rejected gSDE settings. sbx samples new noise at each step, so its gSDE exploration would not depend on the state."""


class JaxDeterministicConfig(DeterministicConfig, JaxNetworkConfig):
    """Settings of TD3's networks."""

    unused: ClassVar[tuple[str, ...]] = ("share_features_extractor",)
    fixed_rate: ClassVar[bool] = True


class JaxSquashedGaussianConfig(SquashedGaussianConfig, JaxNetworkConfig):
    """Settings of SAC's networks."""

    unused: ClassVar[tuple[str, ...]] = ("share_features_extractor", *_EXPLORATION_NETWORK)


class JaxQuantileConfig(QuantileConfig, JaxNetworkConfig):
    """Settings of TQC's networks."""

    unused: ClassVar[tuple[str, ...]] = ("share_features_extractor", *_EXPLORATION_NETWORK)


class JaxBatchNormConfig(BatchNormConfig, JaxNetworkConfig):
    """Settings of CrossQ's networks.

    Attributes:
        batch_norm_momentum: Weight of the new batch in each update of the running statistics. ``frobs-algos-sb3`` uses
            the same definition.
    """

    unused: ClassVar[tuple[str, ...]] = ("share_features_extractor", "batch_norm_eps", *_EXPLORATION_NETWORK)
    fixed_rate: ClassVar[bool] = True

    def to_kwargs(self) -> dict[str, Any]:
        """Return sbx's ``policy_kwargs``, in which the momentum is the weight of the old statistics."""
        kwargs = {**super().to_kwargs(), "batch_norm_momentum": 1.0 - self.batch_norm_momentum}
        if self.optimizer_class in (None, "Adam", "AdamW"):
            kwargs.setdefault("optimizer_kwargs", {"b1": 0.5})  # the default in sbx and sb3-contrib
        return kwargs


class JaxQNetworkConfig(QNetworkConfig, JaxNetworkConfig):
    """Settings of DQN's network.

    Attributes:
        net_arch: Widths of the two hidden layers, which must be equal.
    """

    fixed_rate: ClassVar[bool] = True
    net_arch: Widths = Field(default=[64, 64])

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.net_arch) != 2 or self.net_arch[0] != self.net_arch[1]:
            raise ValueError(
                "net_arch must contain exactly two equal widths, because sbx's DQN supports no other network"
            )
        return self


class SbxSACConfig(SACConfig, JaxConfig):
    """Settings of SAC. The defaults match those of ``frobs-algos-sb3``.

    Attributes:
        policy_delay: Number of critic gradient steps per actor gradient step.
    """

    unsupported: ClassVar[tuple[str, ...]] = ("target_update_interval", _MEMORY, *_EXPLORATION)
    policy_delay: PositiveInt = 1
    policy_kwargs: JaxSquashedGaussianConfig = JaxSquashedGaussianConfig()


class SbxTQCConfig(TQCConfig, JaxConfig):
    """Settings of TQC. The defaults match those of ``frobs-algos-sb3``.

    Attributes:
        policy_delay: Number of critic gradient steps per actor gradient step.
    """

    unsupported: ClassVar[tuple[str, ...]] = SbxSACConfig.unsupported
    policy_delay: PositiveInt = 1
    policy_kwargs: JaxQuantileConfig = JaxQuantileConfig()

    @model_validator(mode="after")
    def _check_critics(self) -> Self:
        if self.policy_kwargs.n_critics != 2:
            raise ValueError("policy_kwargs.n_critics must be 2, because sbx's TQC always has two critics")
        return self


class SbxTD3Config(TD3Config, JaxConfig):
    """Settings of TD3. The defaults match those of ``frobs-algos-sb3``."""

    unsupported: ClassVar[tuple[str, ...]] = (_MEMORY,)
    policy_kwargs: JaxDeterministicConfig = JaxDeterministicConfig()


class SbxCrossQConfig(CrossQConfig, JaxConfig):
    """Settings of CrossQ. The defaults match those of ``frobs-algos-sb3``."""

    unsupported: ClassVar[tuple[str, ...]] = (_MEMORY, *_EXPLORATION)
    policy_kwargs: JaxBatchNormConfig = JaxBatchNormConfig()


class SbxDQNConfig(DQNConfig, JaxConfig):
    """Settings of DQN. The defaults match those of ``frobs-algos-sb3``, except that gradients are not clipped."""

    unsupported: ClassVar[tuple[str, ...]] = ("max_grad_norm",)
    policy_kwargs: JaxQNetworkConfig = JaxQNetworkConfig()


class _Scheduled(OffPolicyAlgorithmJax):
    """Makes the learning rate follow its schedule. In sbx's classes, the learning rate keeps its initial value."""

    def train(self, *args: Any, **kwargs: Any) -> None:
        """Train on samples from the replay buffer."""
        policy: Any = self.policy
        states = (getattr(policy, "actor_state", None), policy.qf_state)
        rate = jnp.float32(self.lr_schedule(self._current_progress_remaining))
        self._update_learning_rate([state.opt_state for state in states if state is not None], rate)
        super().train(*args, **kwargs)


class ScheduledTD3(_Scheduled, sbx.TD3):
    """TD3 with a scheduled learning rate."""


class ScheduledCrossQ(_Scheduled, sbx.CrossQ):
    """CrossQ with a scheduled learning rate."""


class ScheduledDQN(_Scheduled, sbx.DQN):
    """DQN with a scheduled learning rate."""


class SbxSAC(JaxOffPolicy):
    """Soft actor-critic (Haarnoja et al. 2018)."""

    name = "sbx_sac"
    config_model = SbxSACConfig
    model_class = sbx.SAC


class SbxTQC(JaxOffPolicy):
    """Truncated quantile critics (Kuznetsov et al. 2020)."""

    name = "sbx_tqc"
    config_model = SbxTQCConfig
    model_class = sbx.TQC


class SbxTD3(JaxOffPolicy):
    """Twin delayed deep deterministic policy gradient (Fujimoto et al. 2018)."""

    name = "sbx_td3"
    config_model = SbxTD3Config
    model_class = ScheduledTD3


class SbxCrossQ(JaxOffPolicy):
    """CrossQ (Bhatt et al. 2024)."""

    name = "sbx_crossq"
    config_model = SbxCrossQConfig
    model_class = ScheduledCrossQ


class SbxDQN(JaxOffPolicy):
    """Deep Q-network (Mnih et al. 2015)."""

    name = "sbx_dqn"
    config_model = SbxDQNConfig
    model_class = ScheduledDQN
