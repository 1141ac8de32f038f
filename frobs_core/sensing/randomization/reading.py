"""Models of the settings under ``randomize``, and their conversion to distributions and schedules.

This module is imported only if something is randomized, because it imports pydantic.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self, get_args

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StrictBool, model_validator

from frobs_core.sensing.randomization.draw import Distribution, Schedule, Shape


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _two(ends: Any) -> Any:
    if not _is_list(ends) or len(ends) != 2:
        raise ValueError("write a range [lowest, highest]")
    return ends


def _in_order(ends: tuple[Any, Any]) -> tuple[Any, Any]:
    low, high = map(np.array, ends)
    if low.size != high.size or not (low <= high).all():
        raise ValueError("the lowest value exceeds the highest, or they have different lengths")
    return ends


Number = Annotated[float, Field(strict=True, allow_inf_nan=False), BeforeValidator(_plain)]
Numbers = Number | Annotated[list[Number], Field(min_length=1)]  # for a vector, one number for each component
Range = Annotated[tuple[Numbers, Numbers], BeforeValidator(_two), AfterValidator(_in_order)]

Pair = BeforeValidator(lambda value: value if _is_list(value) else (value, value))
Interval = Annotated[tuple[Number, Number], Pair, AfterValidator(_in_order)]
Steps = Annotated[int, Field(strict=True, ge=0, le=1_000)]  # [control steps]
Delay = Annotated[tuple[Steps, Steps], Pair, AfterValidator(_in_order)]

Name = Annotated[str, Field(min_length=1)]
Names = Annotated[list[Name], Field(min_length=1), BeforeValidator(lambda value: value if _is_list(value) else [value])]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    def one_of(self, *keys: str) -> str:
        """Return the only key that is set."""
        chosen = [key for key in keys if getattr(self, key) is not None]
        if len(chosen) != 1:
            raise ValueError(f"expected exactly one of the keys {', '.join(keys)}, got {chosen}")
        return chosen[0]


class _Drawn(_Model):  # one field for each Shape, and the parameters of normal distributions
    constant: Numbers | None = None
    uniform: Range | None = None
    log_uniform: Range | None = None
    normal: Numbers | None = None
    mean: Numbers | None = None
    bounds: Range | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_short_form(cls, given: Any) -> Any:
        return given if isinstance(given, Mapping) else {"uniform" if _is_list(given) else "constant": given}

    @model_validator(mode="after")
    def _check_shape(self) -> Self:
        shape = self.one_of(*get_args(Shape))
        if shape != "normal" and not (self.mean is None and self.bounds is None):
            raise ValueError(f"the distribution '{shape}' accepts neither mean nor bounds; only 'normal' does")
        if self.normal is not None and np.min(self.normal) < 0:
            raise ValueError("the standard deviation of 'normal' must not be negative")
        if self.log_uniform is not None and np.min(self.log_uniform[0]) <= 0:
            raise ValueError("log_uniform requires numbers above 0")
        return self

    def distribution(self, neutral: float | None) -> Distribution:
        """Return the distribution, given the default mean, or None if the mean is required."""
        shape: Any = self.one_of(*get_args(Shape))
        if shape == "normal" and self.mean is None and neutral is None:
            raise ValueError("with 'set', a normal distribution requires a mean, as in {normal: 0.1, mean: 1.0}")
        ends = (self.constant,) * 2 if self.constant is not None else self.uniform or self.log_uniform or self.bounds
        normal = (neutral if self.mean is None else self.mean, self.normal) if shape == "normal" else (0.0, 0.0)
        low, high, mean, std = (np.array(number, np.float64) for number in (*(ends or (-np.inf, np.inf)), *normal))
        return Distribution(shape=shape, low=low, high=high, mean=mean, std=std)


class _Every(_Model):
    steps: Interval | None = None
    seconds: Interval | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_short_form(cls, given: Any) -> Any:
        return given if isinstance(given, Mapping) else {"steps": given}

    @model_validator(mode="after")
    def _check(self) -> Self:
        ends = getattr(self, self.one_of("steps", "seconds"))
        if ends[0] <= 0 or (self.steps is not None and any(end % 1 for end in ends)):
            raise ValueError("write a whole number of control steps ≥ 1, or a time > 0 such as {seconds: 1.0}")
        return self


class _Timed(_Model):
    when: Literal["start", "reset", "step"] | None = None
    every: _Every | None = None

    @model_validator(mode="after")
    def _check_times(self) -> Self:
        if self.when is not None and self.every is not None:
            raise ValueError("'when' and 'every' cannot be combined; choose one")
        return self

    def schedule(self, default: Literal["reset", "step"]) -> Schedule:
        """Return the schedule, given the default of ``when``."""
        if self.every is not None:
            ends = self.every.seconds or self.every.steps or (1.0, 1.0)
            return Schedule(when="interval", interval=ends, in_seconds=self.every.seconds is not None)
        when = self.when or default
        return Schedule(when="interval", interval=(1, 1)) if when == "step" else Schedule(when=when)


class _Gravity(_Timed):
    scale: _Drawn | None = None
    add: _Drawn | None = None
    set: _Drawn | None = None
    shared: StrictBool = False

    @model_validator(mode="after")
    def _check_change(self) -> Self:
        self.change()
        return self

    def change(self) -> tuple[str, Distribution]:
        key = self.one_of("scale", "add", "set")
        drawn: _Drawn = getattr(self, key)
        return key, drawn.distribution({"scale": 1.0, "add": 0.0, "set": None}[key])


class PhysicalSetting(_Gravity):
    """Settings of a physical parameter, such as ``{scale: [0.8, 1.2], target: robot/*}``."""

    target: Names = []


class _ActionDelay(_Timed):
    steps: Delay  # the range includes both ends

    def change(self) -> tuple[str, Distribution]:
        low, high = (np.array(float(end)) for end in self.steps)
        return "set", Distribution(shape="uniform", low=low, high=high, integer=True)


class _ObservationDelay(_ActionDelay):
    target: Names = []


class _Noise(_Drawn, _Timed):
    def change(self) -> tuple[str, Distribution]:
        return "add", self.distribution(0.0)


MODELS: Mapping[str, type[_Timed]] = {
    "gravity": _Gravity,
    "action_delay": _ActionDelay,
    "observation_delay": _ObservationDelay,
    "observation_noise": _Noise,
}
"""Models of the settings that differ from :class:`PhysicalSetting`."""
