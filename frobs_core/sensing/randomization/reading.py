"""Parsers for the parts of a randomization setting: distributions, delays, schedules and targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.sensing.randomization.distribution import Distribution, Shape
from frobs_core.sensing.randomization.schedule import Schedule, When
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, SettingError, UnknownParameterError

Keys = tuple[str | int, ...]
"""Position of a setting under ``randomize``, as mapping keys and list indices."""


class Problem(Exception):  # noqa: N818 - never leaves this package
    """Raised if a setting is invalid.

    Args:
        keys: Position of the setting.
        reason: Description of the problem and its solution, or the exception to raise instead.
    """

    def __init__(self, keys: Keys, reason: str | ConfigurationError) -> None:
        self.keys = keys
        self.reason = reason
        super().__init__(str(reason))

    @staticmethod
    def place(keys: Keys) -> str:
        """Return a position as text, such as ``"randomize.mass[1].scale"``."""
        return "randomize" + "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)

    def as_error(self) -> ConfigurationError:
        """Return the error to show to the user."""
        if isinstance(self.reason, ConfigurationError):
            return self.reason
        return SettingError(self.place(self.keys), self.reason)


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
        raise Problem(keys, f"expected exactly one of the keys {', '.join(Shape)}, got {[*map(str, shapes)]}.")
    (shape,) = shapes
    value = given[shape]
    if shape is not Shape.NORMAL:
        for key in ("mean", "bounds"):
            if key in given:
                raise Problem((*keys, key), f"the distribution '{shape}' does not accept this key; only 'normal' does.")
    match shape:
        case Shape.CONSTANT:
            constant = _number(keys, value)
            return Distribution(shape=shape, low=constant, high=constant)
        case Shape.NORMAL:
            std, mean = _number(keys, value), given.get("mean", neutral)
            if mean is None:
                raise Problem(
                    keys, "with 'set', a normal distribution requires a mean, as in {normal: 0.1, mean: 1.0}."
                )
            if (std < 0).any():
                raise Problem(keys, f"the standard deviation is {value}, but it must not be negative.")
            infinite = np.array(np.inf)
            low, high = _range((*keys, "bounds"), given["bounds"]) if "bounds" in given else (-infinite, infinite)
            return Distribution(shape=shape, low=low, high=high, mean=_number((*keys, "mean"), mean), std=std)
        case _:
            low, high = _range(keys, value)
            if shape is Shape.LOG_UNIFORM and not (low > 0).all():
                raise Problem(keys, f"log_uniform requires numbers above 0, got {value}.")
            return Distribution(shape=shape, low=low, high=high)


def read_steps(keys: Keys, mapping: Mapping[str, Any]) -> Distribution:
    """Parse a delay such as ``steps: 1`` or ``steps: [0, 2]``. A range includes both ends."""
    if "steps" not in mapping:
        raise Problem(keys, "a delay requires the key 'steps', as in {steps: [0, 2]}.")
    value = mapping["steps"]
    pair = value if isinstance(value, Sequence) and not isinstance(value, str) else [value, value]
    if len(pair) != 2 or not all(type(item) is int for item in pair) or not 0 <= pair[0] <= pair[1]:
        raise Problem(
            (*keys, "steps"),
            f"{value!r} is not a valid delay; write a whole number of control steps ≥ 0, or a range [lowest, highest]. "
            "For a delay of a fraction of a step, use a shorter control_timestep.",
        )
    if pair[1] > 1000:
        raise Problem((*keys, "steps"), f"the delay {value!r} exceeds the maximum of 1000 control steps.")
    return Distribution(shape=Shape.UNIFORM, low=np.array(float(pair[0])), high=np.array(float(pair[1])))


def read_schedule(keys: Keys, mapping: Mapping[str, Any], default: When | None) -> Schedule:
    """Parse ``when: start | reset | step``, or ``every: 25`` or ``every: {seconds: [1.0, 2.0]}``.

    Args:
        keys: Position of the setting.
        mapping: The setting.
        default: When to draw if neither ``when`` nor ``every`` is set, or None to draw at each step.
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
        raise Problem(
            (*keys, "when"),
            f"{when!r} is not one of start, reset and step; for other intervals, use a key such as 'every: 25'.",
        )
    return Schedule(when=When(when))


def read_targets(keys: Keys, mapping: Mapping[str, Any]) -> tuple[str, ...]:
    """Parse ``target: robot/*`` or ``target: [link_1, link_2]``."""
    if "target" not in mapping:
        return ()
    given = mapping["target"]
    names = [given] if isinstance(given, str) else given
    if not isinstance(names, Sequence) or not names or not all(isinstance(name, str) and name for name in names):
        raise Problem((*keys, "target"), f"expected a name or a list of names, got {given!r}.")
    return tuple(names)


def _interval(keys: Keys, given: Any) -> Schedule:
    value, in_seconds = given, False
    if isinstance(given, Mapping):
        if set(given) != {"seconds"}:
            raise Problem(
                keys, f"expected a number of control steps or a time such as {{seconds: 1.0}}, got {dict(given)!r}."
            )
        value, in_seconds = given["seconds"], True
    low, high = _range(keys, value) if isinstance(value, Sequence) else (_number(keys, value),) * 2
    if low.ndim or high.ndim or low <= 0 or not (in_seconds or (low % 1 == 0 and high % 1 == 0)):
        raise Problem(
            keys,
            f"{value!r} is not a valid interval; write a whole number of control steps ≥ 1, or a time > 0 such as "
            "{seconds: 1.0}.",
        )
    return Schedule(when=When.INTERVAL, interval=(float(low), float(high)), in_seconds=in_seconds)


def _range(keys: Keys, given: Any) -> tuple[Floats, Floats]:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise Problem(keys, f"{given!r} is not a range; write [lowest, highest].")
    low, high = (_number(keys, end) for end in given)
    if low.size != high.size or not (low <= high).all():
        raise Problem(
            keys, f"in the range {list(given)}, the lowest value exceeds the highest, or they have different lengths."
        )
    return low, high


def _number(keys: Keys, given: Any) -> Floats:
    """Convert a finite number to an array of shape (), or a list of k finite numbers to an array of shape (k,)."""
    items = given if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    for item in items:
        if isinstance(item, bool) or not isinstance(item, int | float | np.number) or not np.isfinite(item):
            raise Problem(keys, f"{item!r} is not a finite number.")
    if not items:
        raise Problem(keys, "the list is empty; write at least one number.")
    return np.array(given, np.float64)
