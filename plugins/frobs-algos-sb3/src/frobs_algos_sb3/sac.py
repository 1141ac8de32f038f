"""Soft actor-critic."""

from __future__ import annotations

from typing import Literal

import stable_baselines3 as sb3
from pydantic import PositiveInt

from frobs_algos.settings import EntropyCoefficient
from frobs_algos_sb3.networks import SquashedGaussianConfig
from frobs_algos_sb3.off_policy import ContinuousConfig, ExploringConfig, OffPolicy


class EntropyConfig(ExploringConfig):
    """Entropy settings of an off-policy algorithm.

    Attributes:
        ent_coef: Weight of the entropy: a fixed number, ``auto`` to learn the weight starting at 1, or ``auto_0.1`` to
            learn it starting at 0.1.
        target_entropy: Target entropy for learning the weight, or ``auto`` for −1 times the number of action
            components.
    """

    ent_coef: EntropyCoefficient = "auto"
    target_entropy: float | Literal["auto"] = "auto"


class SACConfig(EntropyConfig, ContinuousConfig):
    """Settings of SAC, with the defaults of stable-baselines3.

    Attributes:
        target_update_interval: Number of gradient steps between updates of the target networks.
    """

    target_update_interval: PositiveInt = 1
    policy_kwargs: SquashedGaussianConfig = SquashedGaussianConfig()


class SAC(OffPolicy):
    """Soft actor-critic (Haarnoja et al. 2018)."""

    name = "sac"
    config_model = SACConfig
    model_class = sb3.SAC
