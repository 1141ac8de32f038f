"""The plugins and sensors in a model's file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np

from frobs_core.interfaces import Lidar
from frobs_core.rotations import quat_from_rpy
from frobs_ros.bridge.poses import Place
from frobs_ros.errors import GazeboElementError

LIDARS = ("ray", "gpu_ray")
"""Types of ``<sensor>`` elements that are lidars."""
CAMERAS = ("camera", "depth")
"""Types of ``<sensor>`` elements that contain a ``<camera>``."""
SENSORS = (*LIDARS, *CAMERAS, "imu", "contact")
"""Types of ``<sensor>`` elements that are supported."""


@dataclass(frozen=True)
class SensorElement:
    """A ``<sensor>`` of a file.

    Attributes:
        kind: Its ``type`` attribute, such as ``"camera"``.
        link: The link that carries it.
    """

    name: str
    kind: str
    link: str
    element: Element

    @property
    def is_camera(self) -> bool:
        """Whether it contains a ``<camera>``."""
        return self.kind in CAMERAS

    @property
    def has_plugin(self) -> bool:
        """Whether it has a plugin; sensors without a plugin are not simulated."""
        return self.element.find("plugin") is not None

    @property
    def rate(self) -> float:
        """Samples per second [Hz]; 0 if not given."""
        return self.number("update_rate", 0.0)

    @property
    def place(self) -> Place:
        """Pose in the link.

        Raises:
            ConfigurationError: It is not six numbers.
        """
        x, y, z, *rpy = self.numbers("pose", 6)
        return Place(np.array([x, y, z]), quat_from_rpy(rpy))

    def text(self, path: str, default: str = "") -> str:
        """Return the text at a path below the element."""
        return (self.element.findtext(path) or default).strip()

    def number(self, path: str, default: float) -> float:
        """Return the number at a path below the element.

        Raises:
            ConfigurationError: The text is not a number.
        """
        return _number(self.text(path), default, f"the sensor '{self.name}'", path)

    def numbers(self, path: str, count: int) -> list[float]:
        """Return the numbers at a path below the element; zeros if there are none.

        Raises:
            ConfigurationError: The text is not ``count`` numbers.
        """
        return _numbers(self.text(path), count, f"the sensor '{self.name}'", path)

    def error(self, reason: str) -> GazeboElementError:
        """Return an error that names this sensor."""
        return GazeboElementError(f"the sensor '{self.name}'", reason)


@dataclass(frozen=True)
class Plugin:
    """A plugin in a file.

    Attributes:
        file: Name of its library, without ``lib`` and ``.so``.
        parameters: Its parameters, by tag.
        link: The link of its ``<gazebo>`` element or of its sensor; may be empty.
        sensor: The sensor that it belongs to; None: it belongs to the model.
    """

    name: str
    file: str
    parameters: dict[str, str] = field(default_factory=dict)
    link: str = ""
    sensor: SensorElement | None = None

    def text(self, *tags: str, default: str = "") -> str:
        """Return the first existing one of several parameters."""
        return next((self.parameters[tag] for tag in tags if self.parameters.get(tag)), default)

    def number(self, *tags: str, default: float) -> float:
        """Return the first existing one of several parameters, as a number.

        Raises:
            ConfigurationError: The parameter is not a number.
        """
        return _number(self.text(*tags), default, f"the plugin '{self.name}'", tags[0])

    def numbers(self, tag: str, count: int) -> list[float]:
        """Return a parameter as numbers; zeros if it is not given.

        Raises:
            ConfigurationError: The parameter is not ``count`` numbers.
        """
        return _numbers(self.text(tag), count, f"the plugin '{self.name}'", tag)

    def says(self, tag: str, default: bool) -> bool:
        """Return whether a parameter is true."""
        text = self.text(tag).lower()
        return text in ("1", "true") if text else default


def read_plugins(elements: Iterable[Element]) -> Iterator[Plugin]:
    """Yield the plugins of ``<gazebo>`` elements, including those of their sensors."""
    for element in elements:
        link = element.get("reference", "")
        yield from (_plugin(plugin, link) for plugin in element.findall("plugin"))
        for sensor in read_sensors([element]):
            yield from (_plugin(plugin, link, sensor) for plugin in sensor.element.findall("plugin"))


def read_sensors(elements: Iterable[Element]) -> Iterator[SensorElement]:
    """Yield the sensors of ``<gazebo>`` elements."""
    for element in elements:
        for sensor in element.iter("sensor"):
            name = sensor.get("name", "sensor")
            yield SensorElement(name, sensor.get("type", ""), element.get("reference", ""), sensor)


def read_lidars(elements: Iterable[Element]) -> dict[str, Lidar]:
    """Return the planar lidars of ``<gazebo>`` elements, by name.

    Raises:
        ConfigurationError: A lidar has invalid parameters, or is rotated in its link.
    """
    return {sensor.name: _lidar(sensor) for sensor in read_sensors(elements) if sensor.kind in LIDARS}


def _number(text: str | None, default: float, element: str, name: str) -> float:
    try:
        number = float(text) if text else default
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise GazeboElementError(element, f"{name} is '{text}', which is not a number.")
    return number


def _numbers(text: str, count: int, element: str, name: str) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()] or [0.0] * count
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise GazeboElementError(element, f"{name} is '{text}'; it must be {count} finite numbers.")
    return numbers


def _plugin(element: Element, link: str, sensor: SensorElement | None = None) -> Plugin:
    file = element.get("filename", "").rpartition("/")[2].removeprefix("lib").removesuffix(".so")
    parameters = {child.tag: (child.text or "").strip() for child in element}
    return Plugin(element.get("name", file), file, parameters, link, sensor)


def _lidar(sensor: SensorElement) -> Lidar:
    across = "ray/scan/horizontal"
    if any(sensor.numbers("pose", 6)[3:]):
        raise sensor.error(
            f"its pose is '{sensor.element.findtext('pose')}'; rotated lidars are not supported; attach it to a "
            "separate link."
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
