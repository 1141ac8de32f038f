"""Proximal policy optimization."""

from __future__ import annotations

import warnings
from typing import Annotated, Any, ClassVar

import stable_baselines3 as sb3
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt

from frobs_algos_sb3.algorithm import SB3Algorithm
from frobs_algos_sb3.config import ActorCriticConfig, Fraction, SB3Config, Schedule, schedule
from frobs_core.errors import ConfigurationError


class PPOConfig(SB3Config):
    """Settings of PPO; the defaults are those of stable-baselines3.

    Attributes:
        n_steps: Steps of each environment in an iteration.
        batch_size: Steps in a gradient step.
        n_epochs: How often an iteration's steps are gone through.
        gae_lambda: Between one-step advantages (0) and whole returns (1).
        clip_range: Of the ratio of probabilities.
        clip_range_vf: Of the change of values; None: no clipping.
        normalize_advantage: Whether advantages are scaled in each batch.
        ent_coef: Weight of the entropy.
        vf_coef: Weight of the value loss.
        max_grad_norm: What gradients are clipped to.
        use_sde: State-dependent exploration.
        sde_sample_freq: Steps between two draws of its matrix; −1: at the start of an iteration.
        target_kl: Divergence at which an iteration's learning ends early; None: never.
        policy_kwargs: The networks.
    """

    n_steps: PositiveInt = 2048
    batch_size: Annotated[int, Field(ge=2)] = 64
    n_epochs: PositiveInt = 10
    gae_lambda: Fraction = 0.95
    clip_range: Schedule = 0.2
    clip_range_vf: Schedule | None = None
    normalize_advantage: bool = True
    ent_coef: NonNegativeFloat = 0.0
    vf_coef: NonNegativeFloat = 0.5
    max_grad_norm: PositiveFloat = 0.5
    use_sde: bool = False
    sde_sample_freq: Annotated[int, Field(ge=-1)] = -1
    target_kl: PositiveFloat | None = None
    policy_kwargs: ActorCriticConfig = ActorCriticConfig()

    def model_kwargs(self) -> dict[str, Any]:
        """Return the keywords of stable-baselines3's PPO."""
        return super().model_kwargs() | {
            "policy_kwargs": self.policy_kwargs.to_kwargs(),
            "clip_range": schedule(self.clip_range),
            "clip_range_vf": None if self.clip_range_vf is None else schedule(self.clip_range_vf),
        }


class PPO(SB3Algorithm):
    """Proximal policy optimization (Schulman et al. 2017)."""

    name: ClassVar[str] = "ppo"
    config_model: ClassVar[type[SB3Config]] = PPOConfig
    model_class = sb3.PPO

    def _make_model(self, policy: str, **kwargs: Any) -> Any:
        steps = self.venv.num_envs * kwargs["n_steps"]
        if steps < 2:
            raise ConfigurationError("algorithm 'ppo': num_envs × n_steps is 1; it must be at least 2.")
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "You have specified a mini-batch size")  # it works: a smaller last batch
            return super()._make_model(policy, **kwargs)
