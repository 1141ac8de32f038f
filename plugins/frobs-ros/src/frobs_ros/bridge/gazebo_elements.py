"""Plugins and sensors that a model file defines."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass, field
from typing import ClassVar
from xml.etree.ElementTree import Element

import numpy as np

from frobs_core.description import Lidar
from frobs_core.util.rotations import quat_from_rpy
from frobs_models import parse_numbers
from frobs_ros.bridge.poses import Place
from frobs_ros.errors import GazeboElementError

LIDARS = ("ray", "gpu_ray")
"""Sensor types that denote a lidar in a ``<sensor>`` element."""
CAMERAS = ("camera", "depth")
"""Sensor types whose ``<sensor>`` element contains a ``<camera>``."""
SENSORS = (*LIDARS, *CAMERAS, "imu", "contact")
"""Sensor types that the bridge supports in a ``<sensor>`` element."""


class Settings:
    """Settings of a plugin or a sensor."""

    name: str
    title: ClassVar[str]

    def find(self, name: str) -> str | None:
        """Return the text of a setting, or None if the setting is missing."""
        raise NotImplementedError

    def text(self, name: str, default: str = "") -> str:
        """Return the text of a setting, or ``default`` if there is no text."""
        return (self.find(name) or default).strip()

    def number(self, name: str, default: float) -> float:
        """Return the number in a setting, or ``default`` if there is no text.

        Raises:
            ConfigurationError: The text is not a number.
        """
        text = self.text(name)
        try:
            (number,) = parse_numbers(text) if text else (default,)
        except ValueError:
            number = math.nan
        if math.isnan(number):
            raise self.error(f"expected a number in '{name}', got '{text}'.")
        return number

    def numbers(self, name: str, count: int) -> list[float]:
        """Return the ``count`` numbers in a setting, or zeros if there is no text.

        Raises:
            ConfigurationError: The text does not consist of ``count`` finite numbers.
        """
        text = self.text(name)
        try:
            numbers = list(parse_numbers(text)) or [0.0] * count
        except ValueError:
            numbers = []
        if len(numbers) != count or not all(map(math.isfinite, numbers)):
            raise self.error(f"expected {count} finite numbers in '{name}', got '{text}'.")
        return numbers

    def says(self, name: str, default: bool) -> bool:
        """Return whether a setting is true, or ``default`` if there is no text."""
        text = self.text(name).lower()
        return text in ("1", "true") if text else default

    def error(self, reason: str) -> GazeboElementError:
        """Return an error whose message contains the name of the plugin or sensor."""
        return GazeboElementError(f"the {self.title} '{self.name}'", reason)


@dataclass(frozen=True)
class SensorElement(Settings):
    """A ``<sensor>`` element of a model file. Its settings are named by their path in the element.

    Attributes:
        kind: Value of the ``type`` attribute, such as ``"camera"``.
        link: Name of the link to which the sensor is attached.
    """

    title: ClassVar[str] = "sensor"

    name: str
    kind: str
    link: str
    element: Element

    @property
    def is_camera(self) -> bool:
        """Whether the sensor contains a ``<camera>``."""
        return self.kind in CAMERAS

    @property
    def has_plugin(self) -> bool:
        """Whether the sensor has a plugin. Sensors without a plugin are not simulated."""
        return self.element.find("plugin") is not None

    @property
    def rate(self) -> float:
        """Update rate [Hz], or 0 if the file does not specify a rate."""
        return self.number("update_rate", 0.0)

    @property
    def place(self) -> Place:
        """Pose of the sensor in the link frame."""
        x, y, z, *rpy = self.numbers("pose", 6)
        return Place(np.array([x, y, z]), quat_from_rpy(rpy))

    def find(self, name: str) -> str | None:
        """Return the text at a path, or None if there is no such element."""
        return self.element.findtext(name)


@dataclass(frozen=True)
class Plugin(Settings):
    """A plugin that a model file defines.

    Attributes:
        file: Name of the plugin's library, without ``lib`` and ``.so``.
        parameters: Plugin parameters by XML tag.
        link: Link that the ``<gazebo>`` element refers to, or an empty string for the whole model.
        sensor: Sensor that the plugin belongs to, or None for a plugin of the model.
    """

    title: ClassVar[str] = "plugin"

    name: str
    file: str
    parameters: dict[str, str] = field(default_factory=dict)
    link: str = ""
    sensor: SensorElement | None = None

    def find(self, name: str) -> str | None:
        """Return a parameter, or None if it is not set."""
        return self.parameters.get(name)

    def owner(self, element: str, kinds: Container[str]) -> SensorElement:
        """Return the sensor that the plugin belongs to.

        Args:
            element: Description of the required sensor, for the error message.
            kinds: Types of sensors to which the plugin may belong.

        Raises:
            ConfigurationError: The plugin does not belong to such a sensor.
        """
        if self.sensor is None or self.sensor.kind not in kinds:
            raise self.error(f"the plugin must be inside a {element}.")
        return self.sensor

    def lowest_rate(self, name: str, default: float, usual: float) -> float:
        """Return the lower of the sensor's rate and the rate in a parameter [Hz].

        Args:
            name: Name of the parameter.
            default: Value if the parameter is not set. Rates of 0 are ignored.
            usual: Result if neither rate is set.
        """
        rates = (self.sensor.rate if self.sensor else 0.0), self.number(name, default)
        return min((rate for rate in rates if rate > 0.0), default=usual)


def read_plugins(elements: Iterable[Element]) -> Iterator[Plugin]:
    """Yield the plugins in ``<gazebo>`` elements, including the plugins of sensors."""
    for element in elements:
        link = element.get("reference", "")
        yield from (_plugin(plugin, link) for plugin in element.findall("plugin"))
        for sensor in read_sensors([element]):
            yield from (_plugin(plugin, link, sensor) for plugin in sensor.element.findall("plugin"))


def read_sensors(elements: Iterable[Element]) -> Iterator[SensorElement]:
    """Yield the sensors in ``<gazebo>`` elements."""
    for element in elements:
        for sensor in element.iter("sensor"):
            name = sensor.get("name", "sensor")
            yield SensorElement(name, sensor.get("type", ""), element.get("reference", ""), sensor)


def read_lidars(elements: Iterable[Element]) -> dict[str, Lidar]:
    """Return the planar lidars that ``<gazebo>`` elements define, keyed by sensor name.

    Raises:
        ConfigurationError: A lidar has invalid parameters or is rotated relative to its link.
    """
    return {sensor.name: _lidar(sensor) for sensor in read_sensors(elements) if sensor.kind in LIDARS}


def _plugin(element: Element, link: str, sensor: SensorElement | None = None) -> Plugin:
    file = element.get("filename", "").rpartition("/")[2].removeprefix("lib").removesuffix(".so")
    parameters = {child.tag: (child.text or "").strip() for child in element}
    return Plugin(element.get("name", file), file, parameters, link, sensor)


def _lidar(sensor: SensorElement) -> Lidar:
    across = "ray/scan/horizontal"
    if any(sensor.numbers("pose", 6)[3:]):
        raise sensor.error(
            f"the lidar has the rotated pose '{sensor.element.findtext('pose')}', which is not supported; set the "
            "rotation to 0, and attach the lidar to a separate, rotated link."
        )
    x, y, z = sensor.numbers("pose", 6)[:3]
    return Lidar(
        frame=sensor.link,
        rays=round(sensor.number(f"{across}/samples", 640)),
        angle_min=sensor.number(f"{across}/min_angle", 0.0),
        angle_max=sensor.number(f"{across}/max_angle", 0.0),
        range_min=sensor.number("ray/range/min", 0.0),
        range_max=sensor.number("ray/range/max", 30.0),
        offset=(x, y, z),
        rate=sensor.rate or None,
    )
