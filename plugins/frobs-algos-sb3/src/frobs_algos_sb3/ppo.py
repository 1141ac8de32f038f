"""Proximal policy optimization."""

from __future__ import annotations

import warnings
from typing import Annotated, Any, ClassVar

import stable_baselines3 as sb3
from pydantic import Field, PositiveFloat, PositiveInt
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from frobs_algos.settings import Schedule, schedule
from frobs_algos_sb3.config import OnPolicyConfig, SB3Config
from frobs_algos_sb3.on_policy import OnPolicy
from frobs_core.util.errors import ParameterValueError


class PPOConfig(OnPolicyConfig):
    """Settings of PPO, with the defaults of stable-baselines3.

    Attributes:
        batch_size: Number of samples per gradient step.
        n_epochs: Number of passes over the steps of an iteration.
        clip_range: Half-width of the range around 1 in which the probability ratio is not clipped.
        clip_range_vf: Maximum change of the predicted values, or None for no clipping.
        target_kl: KL divergence at which the updates of an iteration end early, or None to perform all updates.
    """

    batch_size: Annotated[int, Field(ge=2)] = 64
    n_epochs: PositiveInt = 10
    clip_range: Schedule = 0.2
    clip_range_vf: Schedule | None = None
    target_kl: PositiveFloat | None = None

    def model_kwargs(self) -> dict[str, Any]:
        return super().model_kwargs() | {
            "clip_range": schedule(self.clip_range),
            "clip_range_vf": None if self.clip_range_vf is None else schedule(self.clip_range_vf),
        }


class PPO(OnPolicy):
    """Proximal policy optimization (Schulman et al. 2017)."""

    name = "ppo"
    config_model: ClassVar[type[SB3Config]] = PPOConfig
    model_class: ClassVar[type[OnPolicyAlgorithm]] = sb3.PPO

    def _make_model(self, policy: str, **kwargs: Any) -> Any:
        steps = self.venv.num_envs * kwargs["n_steps"]
        if steps < 2:
            raise ParameterValueError("num_envs × n_steps", 1, "at least 2", f"algorithm '{self.name}'")
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "You have specified a mini-batch size")  # the last batch may be smaller
            return super()._make_model(policy, **kwargs)
