"""FRobs_RL's algorithms, each of which reads its own block of the YAML file."""

from __future__ import annotations

from typing import ClassVar

from frobs_rl_compat.training.basic_model import BasicModel
from frobs_rl_compat.training.on_policy import OnPolicyModel


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
