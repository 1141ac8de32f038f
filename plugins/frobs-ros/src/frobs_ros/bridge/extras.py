"""What a model's file asks of Gazebo beside bodies and joints: plugins and sensors."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

from frobs_core.interfaces import Lidar
from frobs_ros.errors import GazeboElementError


@dataclass(frozen=True)
class Plugin:
    """A plugin that a file asks for.

    Attributes:
        file: Its library, without ``lib`` and ``.so``.
        parameters: What stands in it, by tag.
        link: The link whose ``<gazebo>`` element it stands in, or that its sensor is on; may be empty.
        sensor: Name of the sensor that it belongs to; empty: of the model.
    """

    name: str
    file: str
    parameters: dict[str, str] = field(default_factory=dict)
    link: str = ""
    sensor: str = ""

    def text(self, *tags: str, default: str = "") -> str:
        """Return the first of several parameters that is there."""
        return next((self.parameters[tag] for tag in tags if self.parameters.get(tag)), default)

    def number(self, *tags: str, default: float) -> float:
        """Return the first of several parameters that is there, as a number.

        Raises:
            ConfigurationError: It is none.
        """
        return _number(self.text(*tags), default, f"the plugin '{self.name}'", tags[0])

    def says(self, tag: str, default: bool) -> bool:
        """Return whether a parameter is true."""
        text = self.text(tag).lower()
        return text in ("1", "true") if text else default


def read_plugins(elements: Iterable[Element]) -> Iterator[Plugin]:
    """Yield the plugins of ``<gazebo>`` elements, those of their sensors among them."""
    for element in elements:
        link = element.get("reference", "")
        yield from (_plugin(plugin, link) for plugin in element.findall("plugin"))
        for sensor in element.iter("sensor"):
            yield from (_plugin(plugin, link, _sensor_name(sensor)) for plugin in sensor.findall("plugin"))


def read_lidars(elements: Iterable[Element]) -> dict[str, Lidar]:
    """Return the planar lidars of ``<gazebo>`` elements, by name.

    Raises:
        ConfigurationError: One has impossible numbers.
    """
    found = {}
    for element in elements:
        for sensor in element.iter("sensor"):
            if sensor.get("type") in ("ray", "gpu_ray"):
                found[_sensor_name(sensor)] = _lidar(sensor, element.get("reference", ""))
    return found


def _number(text: str | None, default: float, element: str, name: str) -> float:
    try:
        return float(text) if text else default
    except ValueError as error:
        raise GazeboElementError(element, f"{name} is '{text}', which is no number.") from error


def _plugin(element: Element, link: str, sensor: str = "") -> Plugin:
    file = element.get("filename", "").rpartition("/")[2].removeprefix("lib").removesuffix(".so")
    parameters = {child.tag: (child.text or "").strip() for child in element}
    return Plugin(element.get("name", file), file, parameters, link, sensor)


def _sensor_name(sensor: Element) -> str:
    return sensor.get("name", "sensor")


def _lidar(sensor: Element, link: str) -> Lidar:
    def number(path: str, default: float) -> float:
        return _number(sensor.findtext(path), default, f"the sensor '{_sensor_name(sensor)}'", path)

    across = "ray/scan/horizontal"
    return Lidar(
        frame=link,
        rays=round(number(f"{across}/samples", 640)),
        angle_min=number(f"{across}/min_angle", 0.0),
        angle_max=number(f"{across}/max_angle", 0.0),
        range_min=number("ray/range/min", 0.0),
        range_max=number("ray/range/max", 30.0),
        offset=_offset(sensor),
        rate=number("update_rate", 0.0) or None,
    )


def _offset(sensor: Element) -> tuple[float, float, float]:
    numbers = [float(number) for number in (sensor.findtext("pose") or "").split()] or [0.0] * 6
    if len(numbers) != 6 or any(numbers[3:]):
        raise GazeboElementError(
            f"the sensor '{_sensor_name(sensor)}'",
            f"its pose is '{sensor.findtext('pose')}'; rotated sensors are not supported: give it a link of its own.",
        )
    return numbers[0], numbers[1], numbers[2]
