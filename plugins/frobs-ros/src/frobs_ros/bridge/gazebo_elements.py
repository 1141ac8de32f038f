"""Plugins and sensors that a model file defines."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
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


@dataclass(frozen=True)
class SensorElement:
    """A ``<sensor>`` element of a model file.

    Attributes:
        kind: Value of the ``type`` attribute, such as ``"camera"``.
        link: Name of the link to which the sensor is attached.
    """

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

    def text(self, path: str, default: str = "") -> str:
        """Return the text at ``path`` within the element, or ``default`` if there is no text."""
        return (self.element.findtext(path) or default).strip()

    def number(self, path: str, default: float) -> float:
        """Return the number at ``path`` within the element, or ``default`` if there is no text.

        Raises:
            ConfigurationError: The text is not a number.
        """
        return _number(self.text(path), default, f"the sensor '{self.name}'", path)

    def numbers(self, path: str, count: int) -> list[float]:
        """Return ``count`` numbers from ``path`` within the element, or zeros if there is no text.

        Raises:
            ConfigurationError: The text does not consist of ``count`` finite numbers.
        """
        return _numbers(self.text(path), count, f"the sensor '{self.name}'", path)

    def error(self, reason: str) -> GazeboElementError:
        """Return an error whose message contains the sensor's name."""
        return GazeboElementError(f"the sensor '{self.name}'", reason)


@dataclass(frozen=True)
class Plugin:
    """A plugin that a model file defines.

    Attributes:
        file: Name of the plugin's library, without ``lib`` and ``.so``.
        parameters: Plugin parameters by XML tag.
        link: Link that the ``<gazebo>`` element refers to, or an empty string for the whole model.
        sensor: Sensor that the plugin belongs to, or None for a plugin of the model.
    """

    name: str
    file: str
    parameters: dict[str, str] = field(default_factory=dict)
    link: str = ""
    sensor: SensorElement | None = None

    def text(self, *tags: str, default: str = "") -> str:
        """Return the value of the first parameter in ``tags`` that is set, or ``default``."""
        return next((self.parameters[tag] for tag in tags if self.parameters.get(tag)), default)

    def number(self, *tags: str, default: float) -> float:
        """Return the number of the first parameter in ``tags`` that is set, or ``default``.

        Raises:
            ConfigurationError: The parameter is not a number.
        """
        return _number(self.text(*tags), default, f"the plugin '{self.name}'", tags[0])

    def numbers(self, tag: str, count: int) -> list[float]:
        """Return a parameter as ``count`` numbers, or zeros if it is not set.

        Raises:
            ConfigurationError: The parameter does not consist of ``count`` finite numbers.
        """
        return _numbers(self.text(tag), count, f"the plugin '{self.name}'", tag)

    def says(self, tag: str, default: bool) -> bool:
        """Return whether a parameter is true, or ``default`` if it is not set."""
        text = self.text(tag).lower()
        return text in ("1", "true") if text else default


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


def _number(text: str | None, default: float, element: str, name: str) -> float:
    try:
        (number,) = parse_numbers(text) if text else (default,)
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise GazeboElementError(element, f"expected a number in '{name}', got '{text}'.")
    return number


def _numbers(text: str, count: int, element: str, name: str) -> list[float]:
    try:
        numbers = list(parse_numbers(text)) or [0.0] * count
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise GazeboElementError(element, f"expected {count} finite numbers in '{name}', got '{text}'.")
    return numbers


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
