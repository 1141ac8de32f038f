"""Validates the user's settings under ``randomize`` before the environment is built.

::

    randomize:
      mass: {scale: [0.8, 1.2]}                     # uniform; when: reset
      stiffness: {scale: {normal: 0.1}, when: start}
      friction: {target: floor, set: {log_uniform: [0.3, 1.2]}}
      gravity: {add: {normal: 0.05}, every: 25}
      action_delay: {steps: [0, 2]}
      observation_noise: {joint_positions: {normal: 0.005}}
      observation_delay: {steps: 1}
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

from frobs_core import plugins
from frobs_core.plugins.records import ParameterRecord
from frobs_core.sensing.randomization.distribution import Distribution, Shape
from frobs_core.sensing.randomization.reading import (
    Problem,
    read_distribution,
    read_schedule,
    read_steps,
    read_targets,
)
from frobs_core.sensing.randomization.schedule import Schedule, When
from frobs_core.util.errors import ConfigFileError, UnknownParameterError
from frobs_core.util.plain import plain
from frobs_core.util.yaml import find_origin

CAPABILITY: Mapping[str, str] = {
    "mass": "randomize_mass",
    "friction": "randomize_friction",
    "size": "randomize_size",
    "stiffness": "randomize_gains",
    "damping": "randomize_gains",
    "joint_damping": "randomize_joint_damping",
    "gravity": "randomize_gravity",
}
"""Simulator capability that each physical parameter of the core requires."""


def physical_parameters() -> Mapping[str, str]:
    """Return all physical parameters of the core and of plugins, each with the required simulator capability."""
    added = {name: cast(ParameterRecord, record).ability for name, record in plugins.records("parameter").items()}
    return {**added, **CAPABILITY}


CHANGES = ("scale", "add", "set")
"""Ways to apply a drawn number: multiply the value by it, add it to the value, or replace the value with it."""

_WHOLE = ("scale", "add", "set", "target", "when", "every", "shared")
_NEUTRAL = {"scale": 1.0, "add": 0.0, "set": None}


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """One randomized quantity.

    Attributes:
        parameter: The randomized quantity, such as ``"mass"`` or ``"action_delay"``.
        place: Location of the setting for error messages, such as ``"randomize.mass"``.
        stream: Name of the random stream. In a snapshot, the name also identifies the drawn numbers.
        targets: Name patterns of the targets, or empty for the parameter's default targets.
        change: ``scale``, ``add`` or ``set``.
        distribution: Distribution of the drawn numbers. For a delay, these are whole numbers of control steps.
        schedule: When numbers are drawn.
        shared: Whether all targets use the same drawn number.
    """

    parameter: str
    place: str
    stream: str
    targets: tuple[str, ...]
    change: str
    distribution: Distribution
    schedule: Schedule
    shared: bool = False


@dataclass(frozen=True, eq=False)
class Settings:
    """All settings under ``randomize``.

    Attributes:
        given: The settings as plain dictionaries and lists.
        items: One setting for each randomized quantity, in the user's order.
    """

    given: dict[str, Any]
    items: tuple[Setting, ...]

    def of(self, parameter: str) -> list[Setting]:
        """Return the settings of a parameter."""
        return [item for item in self.items if item.parameter == parameter]


def read_settings(given: Mapping[str, Any] | None) -> Settings | None:
    """Validate the settings under ``randomize``.

    Args:
        given: For each parameter, one mapping or a list of mappings that are applied in order. If ``given`` is a
            :class:`frobs_core.util.yaml.ConfigMapping`, error messages contain the file and line.

    Returns:
        The settings, or None if nothing is randomized.

    Raises:
        UnknownParameterError: A parameter or key is unknown. The message suggests the most similar valid name.
        ConfigurationError: A value is invalid.
        ConfigFileError: The settings were read from a file and have one of the problems above.
    """
    if not given:
        return None
    try:
        if not isinstance(given, Mapping):
            raise Problem((), f"expected a mapping such as {{mass: {{scale: [0.8, 1.2]}}}}, got {given!r}.")
        items: list[Setting] = []
        for name, entry in given.items():
            known = (*physical_parameters(), *_READERS)
            if name not in known:
                raise Problem((name,), UnknownParameterError("randomize", str(name), known))
            read = _READERS.get(name, _read_physical)
            items += read(name, entry)
    except Problem as problem:
        error = problem.as_error()
        origin = find_origin(given, problem.keys) if isinstance(given, Mapping) else None
        raise (ConfigFileError(*origin, str(error)) if origin else error) from None
    return Settings(plain(given, for_yaml=True), tuple(items))


def _read_physical(parameter: str, entry: Any) -> list[Setting]:
    settings = []
    for keys, mapping, stream in _each((parameter,), entry, parameter):
        _check_keys(keys, mapping, _WHOLE if parameter != "gravity" else tuple(k for k in _WHOLE if k != "target"))
        chosen = [change for change in CHANGES if change in mapping]
        if len(chosen) != 1:
            raise Problem(keys, f"expected exactly one of the keys {', '.join(CHANGES)}, got {chosen}.")
        (change,) = chosen
        shared = mapping.get("shared", False)
        if not isinstance(shared, bool):
            raise Problem((*keys, "shared"), f"expected true or false, got {shared!r}.")
        settings.append(
            Setting(
                parameter=parameter,
                place=Problem.place(keys),
                stream=stream,
                targets=read_targets(keys, mapping),
                change=change,
                distribution=read_distribution((*keys, change), mapping[change], _NEUTRAL[change]),
                schedule=read_schedule(keys, mapping, When.RESET),
                shared=shared,
            )
        )
    return settings


def _read_delay(parameter: str, entry: Any) -> list[Setting]:
    settings = []
    of_actions = parameter == "action_delay"
    for keys, mapping, stream in _each((parameter,), entry, parameter):
        if of_actions and keys[-1] != parameter:
            raise Problem((parameter,), "expected a single mapping, not a list, because an action has only one delay.")
        _check_keys(keys, mapping, ("steps", "when", "every") if of_actions else ("steps", "target", "when", "every"))
        settings.append(
            Setting(
                parameter=parameter,
                place=Problem.place(keys),
                stream=stream,
                targets=read_targets(keys, mapping),
                change="set",
                distribution=read_steps(keys, mapping),
                schedule=read_schedule(keys, mapping, When.RESET),
            )
        )
    return settings


def _read_noise(parameter: str, entry: Any) -> list[Setting]:
    if not isinstance(entry, Mapping) or not entry:
        raise Problem(
            (parameter,), f"expected a mapping such as {{joint_positions: {{normal: 0.005}}}}, got {entry!r}."
        )
    settings = []
    shapes = tuple(str(shape) for shape in Shape)
    for term, noise in entry.items():
        for keys, mapping, stream in _each((parameter, term), noise, f"{parameter}/{term}"):
            _check_keys(keys, mapping, (*shapes, "mean", "bounds", "when", "every"))
            settings.append(
                Setting(
                    parameter=parameter,
                    place=Problem.place(keys),
                    stream=stream,
                    targets=(str(term),),
                    change="add",
                    distribution=read_distribution(
                        keys, {key: mapping[key] for key in (*shapes, "mean", "bounds") if key in mapping}, 0.0
                    ),
                    schedule=read_schedule(keys, mapping, None),
                )
            )
    return settings


_READERS = {"action_delay": _read_delay, "observation_delay": _read_delay, "observation_noise": _read_noise}


def _each(
    keys: tuple[str | int, ...], entry: Any, stream: str
) -> list[tuple[tuple[str | int, ...], Mapping[str, Any], str]]:
    """Return each mapping of an entry (a mapping or a list of mappings) with its position and random stream."""
    many = isinstance(entry, Sequence) and not isinstance(entry, str)
    found = []
    for number, mapping in enumerate(entry if many else [entry]):
        place = (*keys, number) if many else keys
        if not isinstance(mapping, Mapping) or not mapping:
            raise Problem(
                place,
                "expected a mapping such as {scale: [0.8, 1.2]} (for a delay: {steps: 2}, for the noise of an observation "
                f"term: {{normal: 0.1}}), got {mapping!r}.",
            )
        found.append((place, mapping, f"{stream}/{number}"))
    if not found:
        raise Problem(keys, "the list is empty; remove it or add a setting.")
    return found


def _check_keys(keys: tuple[str | int, ...], mapping: Mapping[str, Any], known: Sequence[str]) -> None:
    for key in mapping:
        if key not in known:
            raise Problem((*keys, key), UnknownParameterError(f"'{Problem.place(keys)}'", str(key), known))
