"""Twin delayed deep deterministic policy gradient."""

from __future__ import annotations

import stable_baselines3 as sb3
from pydantic import NonNegativeFloat, PositiveInt

from frobs_algos.settings import Schedule
from frobs_algos_sb3.off_policy import ContinuousConfig, OffPolicy


class TD3Config(ContinuousConfig):
    """Settings of TD3, with the defaults of stable-baselines3.

    Attributes:
        policy_delay: Number of critic gradient steps per actor gradient step.
        target_policy_noise: Standard deviation of the noise on target actions.
        target_noise_clip: Maximum absolute value of the noise on target actions.
    """

    learning_rate: Schedule = 1e-3
    policy_delay: PositiveInt = 2
    target_policy_noise: NonNegativeFloat = 0.2
    target_noise_clip: NonNegativeFloat = 0.5


class TD3(OffPolicy):
    """Twin delayed deep deterministic policy gradient (Fujimoto et al. 2018)."""

    name = "td3"
    config_model = TD3Config
    model_class = sb3.TD3
