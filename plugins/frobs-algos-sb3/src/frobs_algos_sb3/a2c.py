"""Advantage actor-critic."""

from __future__ import annotations

import stable_baselines3 as sb3
from pydantic import PositiveFloat, PositiveInt

from frobs_algos.settings import Fraction, Schedule
from frobs_algos_sb3.config import OnPolicyConfig
from frobs_algos_sb3.on_policy import OnPolicy


class A2CConfig(OnPolicyConfig):
    """Settings of A2C, with the defaults of stable-baselines3.

    Attributes:
        use_rms_prop: Whether to use the RMSprop optimizer, unless ``policy_kwargs`` specifies another optimizer.
        rms_prop_eps: Constant added to RMSprop's denominator.
    """

    learning_rate: Schedule = 7e-4
    n_steps: PositiveInt = 5
    gae_lambda: Fraction = 1.0
    normalize_advantage: bool = False
    use_rms_prop: bool = True
    rms_prop_eps: PositiveFloat = 1e-5


class A2C(OnPolicy):
    """Synchronous advantage actor-critic (Mnih et al. 2016)."""

    name = "a2c"
    config_model = A2CConfig
    model_class = sb3.A2C
