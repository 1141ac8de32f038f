"""Building blocks of settings: the base class, schedules and fractions."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

__all__ = ["Fraction", "Schedule", "Settings", "schedule"]

_LINEAR = re.compile(r"^lin_(.+)$")


def _check_schedule(value: float | str) -> float | str:
    if isinstance(value, str):
        match = _LINEAR.match(value)
        try:
            number = float(match[1]) if match else 0.0
        except ValueError:
            number = 0.0
        if number <= 0.0:
            raise ValueError(
                "write a positive number, or 'lin_' followed by a positive initial value that decreases linearly to 0"
            )
    elif not value > 0.0:
        raise ValueError("must be positive")
    return value


Schedule = Annotated[float | str, Field(union_mode="left_to_right"), AfterValidator(_check_schedule)]
"""A positive number, or text such as ``"lin_3e-4"`` for a number that decreases linearly to 0 during training."""

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


def schedule(value: float | str) -> float | Callable[[float], float]:
    """Return a number, or a function of the remaining progress of training, which decreases from 1 to 0."""
    if isinstance(value, str):
        start = float(value.removeprefix("lin_"))
        return lambda remaining: start * remaining
    return value


class Settings(BaseModel):
    """Base class of immutable settings that reject unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")
