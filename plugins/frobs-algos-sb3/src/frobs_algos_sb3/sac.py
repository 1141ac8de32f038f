"""Soft actor-critic."""

from __future__ import annotations

import re
from typing import Annotated, ClassVar, Literal

import stable_baselines3 as sb3
from pydantic import AfterValidator, Field, PositiveInt

from frobs_algos_sb3.config import SB3Config
from frobs_algos_sb3.networks import SquashedGaussianConfig
from frobs_algos_sb3.off_policy import ContinuousConfig, ExploringConfig, OffPolicy

_AUTO = re.compile(r"^auto(_(\d+\.?\d*|\.\d+)(e[+-]?\d+)?)?$")


def _check_coefficient(value: float | str) -> float | str:
    if isinstance(value, str):
        if not _AUTO.match(value) or (value != "auto" and float(value.removeprefix("auto_")) <= 0.0):
            raise ValueError("write a number ≥ 0, 'auto', or 'auto_' followed by a positive initial value")
    elif not value >= 0.0:
        raise ValueError("must be ≥ 0")
    return value


EntropyCoefficient = Annotated[float | str, Field(union_mode="left_to_right"), AfterValidator(_check_coefficient)]
"""A fixed number, ``"auto"`` to learn the coefficient starting at 1, or ``"auto_0.1"`` to learn it starting at 0.1."""


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

    name: ClassVar[str] = "sac"
    config_model: ClassVar[type[SB3Config]] = SACConfig
    model_class = sb3.SAC
