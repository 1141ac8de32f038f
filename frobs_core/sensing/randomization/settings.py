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
      color: {target: cube, set: [0, 1]}
      camera_position: {target: overview, add: {normal: 0.02}}
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from frobs_core import plugins
from frobs_core.plugins.records import ParameterRecord
from frobs_core.sensing.randomization.draw import Setting
from frobs_core.util.errors import ConfigurationError, SettingError, check_keys
from frobs_core.util.plain import plain
from frobs_core.util.validation import located, validate

CAPABILITY: Mapping[str, str] = {
    "mass": "randomize_mass",
    "friction": "randomize_friction",
    "size": "randomize_size",
    "stiffness": "randomize_gains",
    "damping": "randomize_gains",
    "joint_damping": "randomize_joint_damping",
    "gravity": "randomize_gravity",
    "color": "randomize_looks",
    "light": "randomize_looks",
    "camera_position": "randomize_cameras",
    "camera_rotation": "randomize_cameras",
    "camera_fov": "randomize_cameras",
    "texture": "randomize_scenery",
    "distractors": "randomize_scenery",
}
"""Simulator capability that each parameter of the core requires. The last seven change only images."""


def physical_parameters() -> Mapping[str, str]:
    """Return all physical parameters of the core and of plugins, each with the required simulator capability."""
    added = {name: record.capability for name, record in plugins.records(ParameterRecord).items()}
    return {**added, **CAPABILITY}


_SPECIAL = ("action_delay", "observation_delay", "observation_noise")


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
    if not isinstance(given, Mapping):
        raise SettingError("randomize", f"expected a mapping such as {{mass: {{scale: [0.8, 1.2]}}}}, got {given!r}.")
    items: list[Setting] = []
    known = (*physical_parameters(), *_SPECIAL)
    for name, entry in given.items():
        try:
            check_keys("randomize", [name], known)
            items += _read(name, entry)
        except ConfigurationError as error:
            raise located(error, given, [name]) from None
    return Settings(plain(given, for_yaml=True), tuple(items))


def _read(parameter: str, entry: Any, term: str = "") -> list[Setting]:
    """Read the settings of a parameter, or those of the noise of an observation term."""
    from frobs_core.sensing.randomization.reading import MODELS, PhysicalSetting

    place = f"randomize.{parameter}" + (f".{term}" if term else "")
    is_noise = parameter == "observation_noise"
    if parameter == "action_delay" and not isinstance(entry, Mapping):
        raise SettingError(place, "expected a single mapping, not a list, because an action has only one delay.")
    if is_noise and not term:
        if not (isinstance(entry, Mapping) and entry):
            raise SettingError(
                place, f"expected a mapping such as {{joint_positions: {{normal: 0.005}}}}, got {entry!r}."
            )
        return [setting for name, noise in entry.items() for setting in _read(parameter, noise, name)]
    settings = []
    for number, (where, mapping) in enumerate(_each(place, entry)):
        model: Any = validate(MODELS.get(parameter, PhysicalSetting), mapping, where)
        change, distribution = model.change()
        settings.append(
            Setting(
                parameter=parameter,
                place=where,
                stream=f"{parameter}/{term}/{number}" if term else f"{parameter}/{number}",
                targets=(term,) if term else tuple(getattr(model, "target", ())),
                change=change,
                distribution=distribution,
                schedule=model.schedule("step" if is_noise else "reset"),
                shared=getattr(model, "shared", False),
            )
        )
    return settings


def _each(place: str, entry: Any) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield each mapping of an entry, which is a mapping or a list of them, with its place."""
    is_list = isinstance(entry, Sequence) and not isinstance(entry, str)
    if is_list and not entry:
        raise SettingError(place, "the list is empty; remove it or add a setting.")
    for number, mapping in enumerate(entry if is_list else [entry]):
        where = f"{place}[{number}]" if is_list else place
        if not isinstance(mapping, Mapping) or not mapping:
            raise SettingError(
                where,
                "expected a mapping such as {scale: [0.8, 1.2]} (for a delay: {steps: 2}, for the noise of an "
                f"observation term: {{normal: 0.1}}), got {mapping!r}.",
            )
        yield where, mapping
