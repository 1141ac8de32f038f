"""Building blocks of settings: the base class, schedules, fractions, and the names of networks' parts."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PositiveInt

__all__ = [
    "ACTIVATIONS",
    "Activation",
    "EntropyCoefficient",
    "Fraction",
    "Schedule",
    "Settings",
    "Widths",
    "schedule",
]

_LINEAR = re.compile(r"^lin_(.+)$")
_AUTO = re.compile(r"^auto(_(\d+\.?\d*|\.\d+)(e[+-]?\d+)?)?$")


def _check_schedule(value: float | str) -> float | str:
    if isinstance(value, str):
        match = _LINEAR.match(value)
        try:
            number = float(match[1]) if match else 0.0
        except ValueError:
            number = 0.0
        if not 0.0 < number < math.inf:
            raise ValueError(
                "write a positive number, or 'lin_' followed by a positive initial value that decreases linearly to 0"
            )
    elif not 0.0 < value < math.inf:
        raise ValueError("must be positive and finite")
    return value


Schedule = Annotated[float | str, Field(union_mode="left_to_right"), AfterValidator(_check_schedule)]
"""A positive number, or text such as ``"lin_3e-4"`` for a number that decreases linearly to 0 during training."""


def schedule(value: float | str) -> float | Callable[[float], float]:
    """Return a number, or a function of the remaining progress of training, which decreases from 1 to 0."""
    if isinstance(value, str):
        start = float(value.removeprefix("lin_"))
        return lambda remaining: start * max(0.0, remaining)  # the last rollout may exceed the steps
    return value


def _check_coefficient(value: float | str) -> float | str:
    if isinstance(value, str):
        if not _AUTO.match(value) or (value != "auto" and float(value.removeprefix("auto_")) <= 0.0):
            raise ValueError("write a number ≥ 0, 'auto', or 'auto_' followed by a positive initial value")
    elif not value >= 0.0:
        raise ValueError("must be ≥ 0")
    return value


EntropyCoefficient = Annotated[float | str, Field(union_mode="left_to_right"), AfterValidator(_check_coefficient)]
"""A fixed number, ``"auto"`` to learn the coefficient starting at 1, or ``"auto_0.1"`` to learn it starting at 0.1."""

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]

Widths = list[PositiveInt]
"""Widths of the hidden layers, from the first to the last."""

Activation = Literal["relu", "tanh", "elu", "selu", "gelu", "silu", "leaky_relu"]

ACTIVATIONS = {
    "relu": "ReLU",
    "tanh": "Tanh",
    "elu": "ELU",
    "selu": "SELU",
    "gelu": "GELU",
    "silu": "SiLU",
    "leaky_relu": "LeakyReLU",
}
"""PyTorch's name of each activation function."""


class Settings(BaseModel):
    """Base class of immutable settings that reject unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @property
    def scales_observation(self) -> bool:
        """Whether the networks multiply observations by the scale factors that the task suggests."""
        return False
