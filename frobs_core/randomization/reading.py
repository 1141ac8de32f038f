"""Parsers for the parts of a setting: distributions, times and targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError, RandomizationError, UnknownParameterError
from frobs_core.randomization.distribution import Distribution, Shape
from frobs_core.randomization.schedule import Schedule, When

Keys = tuple[str | int, ...]
"""Position of a setting under ``randomize``, as mapping keys and list indices."""


class Problem(Exception):  # noqa: N818 - never leaves this package
    """Raised if a setting is invalid.

    Args:
        keys: Position of the setting.
        reason: Description of the problem and its solution, or the error for the user.
    """

    def __init__(self, keys: Keys, reason: str | ConfigurationError) -> None:
        self.keys = keys
        self.reason = reason
        super().__init__(str(reason))

    @staticmethod
    def place(keys: Keys) -> str:
        """Return a position as users write it: ``"randomize.mass[1].scale"``."""
        return "randomize" + "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)

    def as_error(self) -> ConfigurationError:
        """Return the error to show to the user."""
        if isinstance(self.reason, ConfigurationError):
            return self.reason
        return RandomizationError(self.place(self.keys), self.reason)


def read_distribution(keys: Keys, given: Any, neutral: float | None) -> Distribution:
    """Parse a distribution.

    Args:
        keys: Position of the distribution.
        given: ``1.2``, ``[0.8, 1.2]`` or ``{normal: 0.1}``, …
        neutral: Default mean of a normal distribution, or None if the mean is required.
    """
    if not isinstance(given, Mapping):
        pair = isinstance(given, Sequence) and not isinstance(given, str)
        given = {"uniform": given} if pair else {"constant": given}
    shapes = [shape for shape in Shape if shape in given]
    for key in given:
        if key not in (*Shape, "mean", "bounds"):
            raise Problem((*keys, key), UnknownParameterError(f"'{Problem.place(keys)}'", str(key), [*Shape, "bounds"]))
    if len(shapes) != 1:
        raise Problem(keys, f"write exactly one distribution, one of {', '.join(Shape)}, not {[*map(str, shapes)]}.")
    (shape,) = shapes
    value = given[shape]
    if shape is not Shape.NORMAL:
        for key in ("mean", "bounds"):
            if key in given:
                raise Problem((*keys, key), f"is only used with normal, not with {shape}.")
    match shape:
        case Shape.CONSTANT:
            constant = _number(keys, value)
            return Distribution(shape=shape, low=constant, high=constant)
        case Shape.NORMAL:
            std, mean = _number(keys, value), given.get("mean", neutral)
            if mean is None:
                raise Problem(keys, "a normal distribution that sets a value needs a mean: {normal: 0.1, mean: 1.0}.")
            if (std < 0).any():
                raise Problem(keys, f"a standard deviation must not be negative: {value}.")
            infinite = np.array(np.inf)
            low, high = _range((*keys, "bounds"), given["bounds"]) if "bounds" in given else (-infinite, infinite)
            return Distribution(shape=shape, low=low, high=high, mean=_number((*keys, "mean"), mean), std=std)
        case _:
            low, high = _range(keys, value)
            if shape is Shape.LOG_UNIFORM and not (low > 0).all():
                raise Problem(keys, f"log_uniform requires numbers above 0: {value}.")
            return Distribution(shape=shape, low=low, high=high)


def read_steps(keys: Keys, mapping: Mapping[str, Any]) -> Distribution:
    """Parse a delay: ``steps: 1`` or ``steps: [0, 2]``, including both ends."""
    if "steps" not in mapping:
        raise Problem(keys, "a delay needs its steps: {steps: [0, 2]}.")
    value = mapping["steps"]
    pair = value if isinstance(value, Sequence) and not isinstance(value, str) else [value, value]
    if len(pair) != 2 or not all(type(item) is int for item in pair) or not 0 <= pair[0] <= pair[1]:
        raise Problem(
            (*keys, "steps"),
            f"{value!r}: a delay must be a whole number ≥ 0 of control steps, or [fewest, most]; for other delays, "
            "choose a shorter control_timestep.",
        )
    if pair[1] > 1000:
        raise Problem((*keys, "steps"), f"{value!r}: a delay must be at most 1000 control steps.")
    return Distribution(shape=Shape.UNIFORM, low=np.array(float(pair[0])), high=np.array(float(pair[1])))


def read_schedule(keys: Keys, mapping: Mapping[str, Any], default: When | None) -> Schedule:
    """Parse ``when: start | reset | step``, or ``every: 25`` or ``every: {seconds: [1.0, 2.0]}``.

    Args:
        keys: Position of the setting.
        mapping: The setting.
        default: Time of the draws if neither key is set, or None to draw in each step.
    """
    if "when" in mapping and "every" in mapping:
        raise Problem(keys, "'when' and 'every' cannot be combined; choose one.")
    each_step = Schedule(when=When.INTERVAL, interval=(1, 1))
    if "every" in mapping:
        return _interval((*keys, "every"), mapping["every"])
    if "when" not in mapping:
        return each_step if default is None else Schedule(when=default)
    when = mapping["when"]
    if when == "step":
        return each_step
    if when not in (When.START, When.RESET):
        raise Problem((*keys, "when"), f"{when!r} is not start, reset or step; for other times write 'every: 25'.")
    return Schedule(when=When(when))


def read_targets(keys: Keys, mapping: Mapping[str, Any]) -> tuple[str, ...]:
    """Parse ``target: robot/*`` or ``target: [link_1, link_2]``."""
    if "target" not in mapping:
        return ()
    given = mapping["target"]
    names = [given] if isinstance(given, str) else given
    if not isinstance(names, Sequence) or not names or not all(isinstance(name, str) and name for name in names):
        raise Problem((*keys, "target"), f"{given!r} is not a name or a list of names.")
    return tuple(names)


def _interval(keys: Keys, given: Any) -> Schedule:
    value, in_seconds = given, False
    if isinstance(given, Mapping):
        if set(given) != {"seconds"}:
            raise Problem(keys, f"{dict(given)!r}: write a number of control steps, or {{seconds: 1.0}}.")
        value, in_seconds = given["seconds"], True
    low, high = _range(keys, value) if isinstance(value, Sequence) else (_number(keys, value),) * 2
    if low.ndim or high.ndim or low <= 0 or not (in_seconds or (low % 1 == 0 and high % 1 == 0)):
        raise Problem(keys, f"{value!r}: an interval must be a whole number ≥ 1 of control steps, or {{seconds: 1.0}}.")
    return Schedule(when=When.INTERVAL, interval=(float(low), float(high)), in_seconds=in_seconds)


def _range(keys: Keys, given: Any) -> tuple[Floats, Floats]:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise Problem(keys, f"{given!r} is not a range; write [lowest, highest].")
    low, high = (_number(keys, end) for end in given)
    if low.size != high.size or not (low <= high).all():
        raise Problem(keys, f"{list(given)}: the lowest is above the highest, or they have different lengths.")
    return low, high


def _number(keys: Keys, given: Any) -> Floats:
    """Return a finite number, (), or a list of finite numbers, (k,), as an array."""
    items = given if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    for item in items:
        if isinstance(item, bool) or not isinstance(item, int | float | np.number) or not np.isfinite(item):
            raise Problem(keys, f"{item!r} is not a finite number.")
    if not items:
        raise Problem(keys, "the list is empty; write at least one number.")
    return np.array(given, np.float64)
