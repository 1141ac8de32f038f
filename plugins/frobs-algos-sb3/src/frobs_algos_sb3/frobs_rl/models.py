"""FRobs_RL's algorithms; each reads its own block of the YAML file."""

from __future__ import annotations

from typing import ClassVar

from frobs_algos_sb3.frobs_rl.basic_model import BasicModel
from frobs_algos_sb3.frobs_rl.on_policy import OnPolicyModel


class A2C(OnPolicyModel):
    """Advantage actor-critic; its YAML file has the block ``a2c_params``."""

    algorithm: ClassVar[str] = "a2c"


class DDPG(BasicModel):
    """Deep deterministic policy gradient; its YAML file has the block ``ddpg_params``."""

    algorithm: ClassVar[str] = "ddpg"


class DQN(BasicModel):
    """Deep Q network; its YAML file has the block ``dqn_params``."""

    algorithm: ClassVar[str] = "dqn"


class PPO(OnPolicyModel):
    """Proximal policy optimization; its YAML file has the block ``ppo_params``."""

    algorithm: ClassVar[str] = "ppo"


class SAC(BasicModel):
    """Soft actor-critic; its YAML file has the block ``sac_params``."""

    algorithm: ClassVar[str] = "sac"


class TD3(BasicModel):
    """Twin delayed DDPG; its YAML file has the block ``td3_params``."""

    algorithm: ClassVar[str] = "td3"
