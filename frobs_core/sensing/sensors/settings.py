"""Applies the user's settings under ``sensors`` to a robot's sensors; see :mod:`frobs_core.sensing.sensors`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from frobs_core import plugins
from frobs_core.description import Sensor
from frobs_core.description.sensor import SENSORS
from frobs_core.util.errors import (
    ConfigurationError,
    ParameterValueError,
    PluginError,
    SettingError,
    UnknownParameterError,
    check_name,
)
from frobs_core.util.validation import check_fields, located


def apply_settings(sensors: Mapping[str, Sensor], given: Mapping[str, Any]) -> dict[str, Sensor]:
    """Return a robot's sensors with the user's changes applied.

    Args:
        sensors: Sensors of the robot.
        given: Changes by sensor name: the fields to replace, the fields of a new sensor including ``type``, a complete
            :class:`frobs_core.description.Sensor`, or None to remove the sensor. If ``given`` is a
            :class:`frobs_core.util.yaml.ConfigMapping`, errors contain the file and line.

    Raises:
        UnknownNameError: The robot has no sensor with a given name. The message suggests the most similar name.
        UnknownParameterError: A sensor has no field with a given name. The message suggests the most similar field.
        ConfigurationError: A value is invalid.
        ConfigFileError: A field is unknown or a value is invalid, and the settings were read from a file.
    """
    if not isinstance(given, Mapping):
        raise ParameterValueError(
            "sensors", given, "a mapping from sensor names to settings, such as {'lidar': {'noise': 0.01}}"
        )
    changed = dict(sensors)
    for name, setting in given.items():
        try:
            sensor = _apply(str(name), sensors, setting)
        except ConfigurationError as error:
            keys = [name, error.name] if isinstance(error, UnknownParameterError) else [name]
            raise located(error, given, keys) from None
        if sensor is None:
            changed.pop(name, None)
        else:
            changed[name] = sensor
    return changed


def _apply(name: str, sensors: Mapping[str, Sensor], setting: Any) -> Sensor | None:
    if isinstance(setting, Sensor):
        return setting
    if not isinstance(setting, Mapping | None):
        raise ParameterValueError(
            f"sensors.{name}", setting, "a mapping of settings to change, such as {'noise': 0.01}"
        )
    if setting is None or "type" not in setting:
        check_name("sensor of the robot (a new sensor requires a type)", name, sensors)
    if setting is None:
        return None
    cls = _sensor_type(str(setting["type"])) if "type" in setting else type(sensors[name])
    unchanged = {} if "type" in setting else {item.name: getattr(sensors[name], item.name) for item in fields(cls)}
    settings = {**unchanged, **{key: value for key, value in setting.items() if key != "type"}}
    check_fields(f"sensor '{name}' (a {cls.type_name})", cls, settings)
    try:
        return cls(**settings)
    except ConfigurationError as error:
        raise SettingError(f"sensors.{name}", str(error)) from None


def _sensor_type(name: str) -> type[Sensor]:
    types = {cls.type_name: cls for cls in SENSORS}
    added = plugins.records("sensor_type")
    check_name("type of sensor", name, [*types, *added])
    cls = types[name] if name in types else added[name].load()
    if not (isinstance(cls, type) and issubclass(cls, Sensor)):
        raise PluginError(f"the sensor type '{name}' is {cls!r}, which is not a subclass of Sensor.")
    return cls
