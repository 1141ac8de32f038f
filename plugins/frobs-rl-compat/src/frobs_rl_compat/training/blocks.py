"""The ``<algo>_params`` blocks of FRobs_RL's YAML files, with FRobs_RL's defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, NonNegativeInt, PositiveFloat, PositiveInt

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class Strict(BaseModel):
    """Base class of immutable settings that reject unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class TrainFrequency(Strict):
    """Interval between two training rounds of an off-policy algorithm.

    Attributes:
        freq: Length of the interval in ``unit``.
        unit: Unit of ``freq``: steps or episodes.
    """

    freq: PositiveInt = 20
    unit: Literal["step", "episode"] = "step"


class Block(Strict):
    """Settings that every algorithm accepts.

    Attributes:
        learning_rate: Learning rate of every optimizer.
        gamma: Discount factor per step.
    """

    learning_rate: PositiveFloat
    gamma: Fraction = 0.99

    def attributes(self) -> dict[str, Any]:
        """Return the keyword arguments of the algorithm's class in stable-baselines3."""
        values = self.model_dump()
        if "train_freq" in values:
            values["train_freq"] = (values["train_freq"]["freq"], values["train_freq"]["unit"])
        return values


class OnPolicyBlock(Block):
    """Settings shared by PPO and A2C, named as in stable-baselines3."""

    n_steps: PositiveInt
    gae_lambda: Fraction
    ent_coef: NonNegativeFloat = 0.0
    vf_coef: NonNegativeFloat = 0.5
    max_grad_norm: PositiveFloat = 0.5


class PPOBlock(OnPolicyBlock):
    """Settings in the ``ppo_params`` block."""

    learning_rate: PositiveFloat = 3e-4
    n_steps: PositiveInt = 100
    batch_size: Annotated[int, Field(ge=2)] = 100
    n_epochs: PositiveInt = 5
    gae_lambda: Fraction = 0.95
    clip_range: PositiveFloat = 0.2


class A2CBlock(OnPolicyBlock):
    """Settings in the ``a2c_params`` block."""

    learning_rate: PositiveFloat = 7e-4
    n_steps: PositiveInt = 5
    gae_lambda: Fraction = 1.0
    use_rms_prop: bool = True
    rms_prop_eps: PositiveFloat = 1e-5
    normalize_advantage: bool = False


class OffPolicyBlock(Block):
    """Settings shared by the off-policy algorithms, named as in stable-baselines3."""

    buffer_size: PositiveInt = 1_000_000
    learning_starts: NonNegativeInt = 100
    batch_size: PositiveInt = 100
    tau: Fraction = 0.005
    gradient_steps: Annotated[int, Field(ge=-1)] = -1
    train_freq: TrainFrequency = TrainFrequency()


class DDPGBlock(OffPolicyBlock):
    """Settings in the ``ddpg_params`` block."""

    learning_rate: PositiveFloat = 1e-3


class TD3Block(OffPolicyBlock):
    """Settings in the ``td3_params`` block."""

    learning_rate: PositiveFloat = 1e-3
    policy_delay: PositiveInt = 2
    target_policy_noise: NonNegativeFloat = 0.2
    target_noise_clip: NonNegativeFloat = 0.5


class SACBlock(OffPolicyBlock):
    """Settings in the ``sac_params`` block."""

    learning_rate: PositiveFloat = 3e-4
    batch_size: PositiveInt = 256
    gradient_steps: Annotated[int, Field(ge=-1)] = 1
    ent_coef: NonNegativeFloat | Annotated[str, Field(pattern=r"^auto(_\d+(\.\d+)?)?$")] = "auto"
    target_update_interval: PositiveInt = 1
    target_entropy: float | Literal["auto"] = "auto"


class DQNBlock(OffPolicyBlock):
    """Settings in the ``dqn_params`` block."""

    learning_rate: PositiveFloat = 1e-4
    learning_starts: NonNegativeInt = 50_000
    batch_size: PositiveInt = 32
    tau: Fraction = 1.0
    gradient_steps: Annotated[int, Field(ge=-1)] = 1
    target_update_interval: PositiveInt = 10_000
    exploration_fraction: Fraction = 0.1
    exploration_initial_eps: Fraction = 1.0
    exploration_final_eps: Fraction = 0.05
    max_grad_norm: PositiveFloat = 10.0


BLOCKS: Mapping[str, type[Block]] = {
    "ppo": PPOBlock,
    "a2c": A2CBlock,
    "ddpg": DDPGBlock,
    "dqn": DQNBlock,
    "sac": SACBlock,
    "td3": TD3Block,
}
"""Settings class of each algorithm's block, by algorithm name. In the YAML file, the block is called ``<name>_params``.
"""

WITH_SDE = ("ppo", "a2c", "sac")
"""Algorithms that support state-dependent exploration."""

WITH_NOISE = ("ddpg", "td3", "sac")
"""Algorithms that support action noise."""
