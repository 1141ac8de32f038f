"""Applies the user's settings under ``sensors`` to a robot's sensors, as described in :mod:`frobs_core.sensing.sensors`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields, replace
from typing import Any

from frobs_core import plugins
from frobs_core.description import Sensor
from frobs_core.description.sensor import SENSORS
from frobs_core.util.errors import (
    ConfigFileError,
    ConfigurationError,
    ParameterValueError,
    PluginError,
    SensorSettingError,
    UnknownNameError,
    UnknownParameterError,
)
from frobs_core.util.yaml import find_origin


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
    found = dict(sensors)
    for name, setting in given.items():
        try:
            sensor = _apply(str(name), sensors, setting)
        except ConfigurationError as error:
            key = error.name if isinstance(error, UnknownParameterError) else None
            origin = find_origin(given, [name] if key is None else [name, key])
            if origin is None:
                raise
            raise ConfigFileError(*origin, str(error)) from None
        if sensor is None:
            found.pop(name, None)
        else:
            found[name] = sensor
    return found


def _apply(name: str, sensors: Mapping[str, Sensor], setting: Any) -> Sensor | None:
    if isinstance(setting, Sensor):
        return setting
    if setting is not None and not isinstance(setting, Mapping):
        raise ParameterValueError(
            f"sensors.{name}", setting, "a mapping of settings to change, such as {'noise': 0.01}"
        )
    if setting is not None and "type" in setting:
        return _new(name, setting)
    if name not in sensors:
        raise UnknownNameError("sensor of the robot (a new sensor requires a type)", name, sensors)
    if setting is None:
        return None
    _check_fields(name, type(sensors[name]), setting)
    try:
        return replace(sensors[name], **setting)
    except ConfigurationError as error:
        raise SensorSettingError(name, str(error)) from None


def _new(name: str, setting: Mapping[str, Any]) -> Sensor:
    cls = _sensor_type(str(setting["type"]))
    given = {key: value for key, value in setting.items() if key != "type"}
    _check_fields(name, cls, given)
    missing = [field.name for field in fields(cls) if field.default is MISSING and field.name not in given]
    if missing:
        raise SensorSettingError(name, f"a new {cls.type_name} needs {', '.join(missing)}.")
    try:
        return cls(**given)
    except ConfigurationError as error:
        raise SensorSettingError(name, str(error)) from None


def _sensor_type(name: str) -> type[Sensor]:
    """Return a sensor type of the core or of a plugin.

    Raises:
        UnknownNameError: The type does not exist.
    """
    types = {cls.type_name: cls for cls in SENSORS}
    added = plugins.records("sensor_type")
    if name in types:
        return types[name]
    if name not in added:
        raise UnknownNameError("type of sensor", name, [*types, *added])
    cls = added[name].load()
    if not (isinstance(cls, type) and issubclass(cls, Sensor)):
        raise PluginError(f"the sensor type '{name}' is {cls!r}, which is not a subclass of Sensor.")
    return cls


def _check_fields(name: str, cls: type[Sensor], given: Mapping[str, Any]) -> None:
    known = [field.name for field in fields(cls)]
    for key in given:
        if key not in known:
            raise UnknownParameterError(f"sensor '{name}' (a {cls.type_name})", str(key), known)
