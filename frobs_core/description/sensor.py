"""Descriptions of sensors as data: a robot's measuring devices and their accuracy.

A reading is the true value with imperfections, which :class:`frobs_core.sensing.sensors.Sensors` applies in this order:
noise is added, the sum is rounded to the resolution and clipped to the sensor's range, samples are lost, and the
remaining samples are delayed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Base class of all sensors. A subclass defines a sensor type and names the instrument that takes its measurements.

    Attributes:
        frame: Link that the sensor is fixed to.
        rate: Sampling rate [Hz], or None for one sample per control step. Readings stay constant between samples.
        noise: Standard deviation of the normally distributed noise, in the reading's unit: one number for all elements,
            or one for each element.
        resolution: Readings are rounded to multiples of this number, in the reading's unit, unless it is 0. One number
            for all elements, or one for each element.
        delay: Time between taking a sample and reading it [s].
        dropout: Probability that a sample is lost, in [0, 1] (see :attr:`lost`).
        type_name: Name of this sensor type in configurations.
        instrument: ``"module:attribute"`` of the :class:`frobs_core.sensing.sensors.Instrument` that takes the
            measurements.
        unit: Unit of a reading.
        needs: Simulator capability that the sensor requires, or an empty string if it requires none.

    Raises:
        ConfigurationError: A parameter is not a number or is out of range.
    """

    type_name: ClassVar[str] = ""
    instrument: ClassVar[str] = ""
    unit: ClassVar[str] = ""
    needs: ClassVar[str] = ""

    frame: str
    rate: float | None = None
    noise: float | tuple[float, ...] = 0.0
    resolution: float | tuple[float, ...] = 0.0
    delay: float = 0.0
    dropout: float = 0.0

    def __post_init__(self) -> None:
        for name in ("noise", "resolution"):
            given = getattr(self, name)
            if isinstance(given, list | tuple):
                if len(given) != self.width:
                    raise self._error(name, given, f"one number, or {self.width} numbers, one for each element")
                object.__setattr__(self, name, tuple(given))  # YAML files contain lists
            for number in given if isinstance(given, list | tuple) else [given]:
                self._check(name, number, low=0.0)
        self._check("delay", self.delay, low=0.0)
        self._check("dropout", self.dropout, low=0.0, high=1.0)
        if self.rate is not None:
            self._check("rate", self.rate, above=0.0)

    @property
    def frames(self) -> tuple[str, ...]:
        """All links that are part of the sensor."""
        return (self.frame,)

    @property
    def width(self) -> int:
        """Number of elements in a reading."""
        return 1

    @property
    def bounds(self) -> tuple[float, float]:
        """Minimum and maximum of a reading, in the reading's unit."""
        return -math.inf, math.inf

    @property
    def lost(self) -> float | None:
        """Value that replaces a lost measurement, or None if the previous sample replaces it.

        If the value is a number, elements of a sample are lost individually and read as this value. Rays that hit
        nothing also read as this value, without noise. If the value is None, samples are lost as a whole, and the
        previous sample is kept. If samples are lost as a whole, the first sample after a reset is never lost.
        """
        return None

    @property
    def is_ideal(self) -> bool:
        """Whether samples equal the true values. ``rate`` is ignored because its effect depends on the control step."""
        return not (self.delay or self.dropout or np.any(self.noise) or np.any(self.resolution))

    @property
    def summary(self) -> str:
        """Short description of the measured quantities."""
        return self.type_name

    def _check(
        self, name: str, number: float, low: float = -math.inf, high: float = math.inf, above: float = -math.inf
    ) -> None:
        if isinstance(number, bool) or not isinstance(number, int | float | np.number) or not math.isfinite(number):
            raise self._error(name, number, "a finite number")
        if not low <= number <= high:
            raise self._error(name, number, f"in [{low:g}, {high:g}]")
        if not number > above:
            raise self._error(name, number, f"above {above:g}")

    def _check_offset(self, offset: tuple[float, float, float]) -> None:
        if not isinstance(offset, Sequence) or len(offset) != 3:
            raise self._error("offset", offset, "three numbers")
        for number in offset:
            self._check("offset", number)
        object.__setattr__(self, "offset", tuple(offset))

    def _error(self, name: str, value: object, rule: str) -> ParameterValueError:
        return ParameterValueError(name, value, rule, f"a {self.type_name or type(self).__name__} on '{self.frame}'")


@dataclass(frozen=True, kw_only=True)
class Lidar(Sensor):
    """A planar laser scanner with rays in the xy plane of ``frame``, counterclockwise from ``angle_min``.

    The scanner measures the distance along each ray [m] and does not detect its own robot. Lost rays and rays that hit
    nothing read as ``range_max``.

    Attributes:
        rays: Number of rays. The first ray is at ``angle_min``, and the last ray is at ``angle_max``.
        angle_min: Angle of the first ray [rad].
        angle_max: Angle of the last ray [rad], or None to space the rays evenly over 360 degrees.
        range_min: Minimum reading [m]. A ray that hits a closer object reads as ``range_min``.
        range_max: Maximum reading [m]. A ray that hits a farther object, or nothing, reads as ``range_max``.
        offset: Origin of the rays relative to ``frame`` [m].
    """

    type_name: ClassVar[str] = "lidar"
    instrument: ClassVar[str] = "frobs_core.sensing.sensors.instruments:LidarInstrument"
    unit: ClassVar[str] = "m"
    needs: ClassVar[str] = "rays"

    rays: int
    angle_min: float = -math.pi
    angle_max: float | None = None
    range_min: float
    range_max: float
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if isinstance(self.rays, bool) or not isinstance(self.rays, int | np.integer) or self.rays < 1:
            raise self._error("rays", self.rays, "a whole number ≥ 1")
        super().__post_init__()
        self._check("range_min", self.range_min, low=0.0)
        self._check("range_max", self.range_max, above=self.range_min)
        self._check("angle_min", self.angle_min)
        if self.angle_max is not None:
            self._check("angle_max", self.angle_max, low=self.angle_min)
        self._check_offset(self.offset)

    @property
    def width(self) -> int:
        """Number of rays."""
        return self.rays

    @property
    def bounds(self) -> tuple[float, float]:
        """Minimum and maximum of a reading: ``range_min`` and ``range_max`` [m]."""
        return self.range_min, self.range_max

    @property
    def lost(self) -> float | None:
        """Value of a lost ray: ``range_max`` [m]."""
        return self.range_max

    @property
    def summary(self) -> str:
        """Number, directions and range of the rays."""
        first, last = (math.degrees(angle) for angle in (self.angles[0], self.angles[-1]))
        return f"{self.rays} rays, {first:.5g}° to {last:.5g}°, {self.range_min:g} to {self.range_max:g} m"

    @cached_property
    def angles(self) -> Floats:
        """Angle of each ray from the x axis of ``frame``, counterclockwise, (rays,) [rad]."""
        if self.angle_max is None:
            return np.asarray(self.angle_min + 2.0 * math.pi / self.rays * np.arange(self.rays), np.float64)
        return np.linspace(self.angle_min, self.angle_max, self.rays, dtype=np.float64)

    @cached_property
    def directions(self) -> Floats:
        """Directions of the rays in ``frame``, (rays, 3)."""
        return np.stack([np.cos(self.angles), np.sin(self.angles), np.zeros(self.rays)], axis=-1)


@dataclass(frozen=True, kw_only=True)
class Bumper(Sensor):
    """A switch that closes on contact.

    A bumper reads 1.0 if any of its links touched an object in any physics step of the control step, and 0.0 otherwise.
    If a sample is lost, the previous sample is kept. After a reset, the switch is open.

    Attributes:
        links: Additional links whose contacts close the same switch.
        ignore: Objects that do not close the switch: ``"floor"``, names of scene bodies, or ``"robot"`` for the robot
            itself.
    """

    type_name: ClassVar[str] = "bumper"
    instrument: ClassVar[str] = "frobs_core.sensing.sensors.instruments:BumperInstrument"
    unit: ClassVar[str] = "0 or 1"
    needs: ClassVar[str] = "contacts"
    bounds: ClassVar[tuple[float, float]] = (0.0, 1.0)

    links: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ("floor",)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("links", "ignore"):
            given = getattr(self, name)
            if isinstance(given, str) or not isinstance(given, Sequence) or not all(isinstance(n, str) for n in given):
                raise self._error(name, given, "a list of names")
            object.__setattr__(self, name, tuple(given))
        for name in ("noise", "resolution"):
            if np.any(getattr(self, name)):
                raise self._error(name, getattr(self, name), "omitted, because a bumper reads 0 or 1")

    @property
    def frames(self) -> tuple[str, ...]:
        """The links of the switch."""
        return (self.frame, *self.links)

    @property
    def summary(self) -> str:
        """The links of the switch, and the objects that it ignores."""
        links = ", ".join(self.frames)
        return f"contacts of {links}" + (f", except with {', '.join(self.ignore)}" if self.ignore else "")


@dataclass(frozen=True, kw_only=True)
class Imu(Sensor):
    """An inertial measurement unit: angular velocity [rad/s] and specific force [m/s²] in ``frame``, (3,) each.

    Specific force is acceleration minus gravity, so it points up at rest. The acceleration is averaged over the control
    step by dividing the change in the sensor's velocity by the step's duration. After a reset, the acceleration is 0.
    If a sample is lost, the previous sample is kept.

    Attributes:
        offset: Position of the sensor relative to ``frame`` [m].
    """

    type_name: ClassVar[str] = "imu"
    instrument: ClassVar[str] = "frobs_core.sensing.sensors.instruments:ImuInstrument"
    unit: ClassVar[str] = "rad/s, m/s²"
    needs: ClassVar[str] = "randomize_gravity"  # simulators with this capability also report gravity
    width: ClassVar[int] = 6
    summary: ClassVar[str] = "angular velocity, specific force"

    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_offset(self.offset)


@dataclass(frozen=True, kw_only=True)
class ForceTorque(Sensor):
    """A sensor for the force [N] and torque [N·m], (3,) each, that the base side of the robot exerts on ``frame``.

    The sensor is in the joint above ``frame``, and its axes and origin are those of ``frame``. A reading includes the
    weight and inertia of ``frame`` and of everything beyond it, and is not tared. Readings are averaged over the
    physics steps of the control step. After a reset, the reading is 0 until the next step. If ``frame`` is fixed to its
    parent and carries no mass, the sensor is in the nearest joint above it that carries mass. If a sample is lost, the
    previous sample is kept.
    """

    type_name: ClassVar[str] = "force_torque"
    instrument: ClassVar[str] = "frobs_core.sensing.sensors.instruments:ForceTorqueInstrument"
    unit: ClassVar[str] = "N, N·m"
    needs: ClassVar[str] = "force_torque"
    width: ClassVar[int] = 6
    summary: ClassVar[str] = "force, torque"


SENSORS: tuple[type[Sensor], ...] = (Lidar, Bumper, Imu, ForceTorque)
"""The built-in sensor types."""
