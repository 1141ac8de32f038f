"""Sensors, as data: what a robot carries to measure with, and how well each of them measures.

What a sensor reads is the truth with its faults, in this order: noise is added, the sum is rounded to the resolution and
kept in the sensor's range; samples are lost; the rest arrives late. :class:`frobs_core.sensors.Sensors` does that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ParameterValueError


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """What all sensors have in common. A subclass is a new type of sensor; it names its instrument.

    Attributes:
        frame: Link that it is fixed to.
        rate: Samples per second [Hz]; None: one in each control step. Between two samples the last one stays.
        noise: Standard deviation of what is added to each element, normal, in the reading's unit; one number, or one for
            each element.
        resolution: What a reading is a whole multiple of, in its unit; 0: any number. One, or one for each element.
        delay: [s] from when a sample is taken until it is read.
        dropout: Probability that a sample is lost, in [0, 1]; see :attr:`lost`.
        type_name: What configurations call this type of sensor.
        instrument: ``"module:attribute"`` of the :class:`frobs_core.sensors.Instrument` that measures.
        unit: Of a reading.
        needs: Capability of the simulator that it cannot be read without; empty: none.
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
        """Refuse numbers that no sensor has.

        Raises:
            ConfigurationError: A number is none, or is not in its range.
        """
        for name in ("noise", "resolution"):
            given = getattr(self, name)
            if isinstance(given, list | tuple):
                if len(given) != self.width:
                    raise self._error(name, given, f"one number, or {self.width} numbers, one for each element")
                object.__setattr__(self, name, tuple(given))  # a list, where it comes from YAML
            for number in given if isinstance(given, list | tuple) else [given]:
                self._check(name, number, low=0.0)
        self._check("delay", self.delay, low=0.0)
        self._check("dropout", self.dropout, low=0.0, high=1.0)
        if self.rate is not None:
            self._check("rate", self.rate, above=0.0)

    @property
    def frames(self) -> tuple[str, ...]:
        """Every link that it is part of."""
        return (self.frame,)

    @property
    def width(self) -> int:
        """How many numbers one reading has."""
        return 1

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and greatest number of a reading, in its unit."""
        return -math.inf, math.inf

    @property
    def lost(self) -> float | None:
        """What is read where nothing was measured.

        A number: each element is lost by itself and reads it; one that meets nothing reads it too, and has no noise.
        None: the whole sample is lost, and the last one stays; the first after a reset never is.
        """
        return None

    @property
    def is_ideal(self) -> bool:
        """Whether it reads the truth of each control step; ``rate`` aside, which depends on the control step."""
        return not (self.delay or self.dropout or np.any(self.noise) or np.any(self.resolution))

    @property
    def summary(self) -> str:
        """What it measures, in a few words."""
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
    """A planar laser scanner: rays in the xy plane of ``frame``, counter-clockwise from ``angle_min``.

    It reads the distance [m] along each ray, and does not see its own robot. A ray that is lost reads ``range_max``, as
    one that meets nothing.

    Attributes:
        rays: How many, the first at ``angle_min``, the last at ``angle_max``.
        angle_min: [rad]
        angle_max: [rad]; None: the rays go once round evenly, the last one a step before the first.
        range_min: [m] what is nearer reads as ``range_min``.
        range_max: [m] what is farther, or nothing, reads as ``range_max``.
        offset: Where the rays start, in ``frame`` [m].
    """

    type_name: ClassVar[str] = "lidar"
    instrument: ClassVar[str] = "frobs_core.sensors.lidar:LidarInstrument"
    unit: ClassVar[str] = "m"
    needs: ClassVar[str] = "rays"

    rays: int
    angle_min: float = -math.pi
    angle_max: float | None = None
    range_min: float
    range_max: float
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Validate the parameters."""
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
        """How many rays there are."""
        return self.rays

    @property
    def bounds(self) -> tuple[float, float]:
        """``range_min`` and ``range_max`` [m]."""
        return self.range_min, self.range_max

    @property
    def lost(self) -> float | None:
        """``range_max`` [m]."""
        return self.range_max

    @property
    def summary(self) -> str:
        """Rays, where they point, and how far."""
        first, last = (math.degrees(angle) for angle in (self.angles[0], self.angles[-1]))
        return f"{self.rays} rays, {first:.5g}° to {last:.5g}°, {self.range_min:g} to {self.range_max:g} m"

    @cached_property
    def angles(self) -> Floats:
        """(rays,) [rad] of each ray from the x axis of ``frame``, counter-clockwise."""
        if self.angle_max is None:
            return np.asarray(self.angle_min + 2.0 * math.pi / self.rays * np.arange(self.rays), np.float64)
        return np.linspace(self.angle_min, self.angle_max, self.rays, dtype=np.float64)

    @cached_property
    def directions(self) -> Floats:
        """(rays, 3) where the rays point, in ``frame``."""
        return np.stack([np.cos(self.angles), np.sin(self.angles), np.zeros(self.rays)], axis=-1)


@dataclass(frozen=True, kw_only=True)
class Bumper(Sensor):
    """A switch that closes when links touch something: 1.0 if they did in any physics step of the control step, else 0.0.

    A sample that is lost leaves the last one. After a reset nothing has been touched.

    Attributes:
        links: Further links that close the same switch.
        ignore: What does not close it: ``"floor"``, names of scene bodies, ``"robot"`` for the robot itself.
    """

    type_name: ClassVar[str] = "bumper"
    instrument: ClassVar[str] = "frobs_core.sensors.bumper:BumperInstrument"
    unit: ClassVar[str] = "0 or 1"
    needs: ClassVar[str] = "contacts"

    links: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ("floor",)

    def __post_init__(self) -> None:
        """Refuse what no switch has."""
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
        """The links that close the switch."""
        return (self.frame, *self.links)

    @property
    def bounds(self) -> tuple[float, float]:
        """0 and 1."""
        return 0.0, 1.0

    @property
    def summary(self) -> str:
        """Links, and what does not close the switch."""
        links = ", ".join(self.frames)
        return f"contacts of {links}" + (f", but with {', '.join(self.ignore)}" if self.ignore else "")


@dataclass(frozen=True, kw_only=True)
class Imu(Sensor):
    """An inertial measurement unit: angular velocity [rad/s] and specific force [m/s²], both (3,) in ``frame``.

    Specific force is acceleration minus gravity: at rest it points up. The acceleration is the change of the sensor's
    velocity over the control step, divided by it: the mean over the step, not that of its end; in a reset it is 0. A
    sample that is lost leaves the last one.

    Attributes:
        offset: Where it sits, in ``frame`` [m].
    """

    type_name: ClassVar[str] = "imu"
    instrument: ClassVar[str] = "frobs_core.sensors.imu:ImuInstrument"
    unit: ClassVar[str] = "rad/s, m/s²"
    needs: ClassVar[str] = "randomize_gravity"  # by which a simulator also tells what gravity is

    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse numbers that no such unit has."""
        super().__post_init__()
        self._check_offset(self.offset)

    @property
    def width(self) -> int:
        """Three of the angular velocity, three of the specific force."""
        return 6

    @property
    def summary(self) -> str:
        """What it measures."""
        return "angular velocity, specific force"


@dataclass(frozen=True, kw_only=True)
class ForceTorque(Sensor):
    """A force-torque sensor: force [N] and torque [N·m], both (3,), that the robot exerts on ``frame`` from its base side.

    The sensor is in the joint above ``frame``, and its axes and origin are those of ``frame``. A reading includes the
    weight and inertia of ``frame`` and of everything beyond it; it is not tared. It is averaged over the physics steps of
    the control step. After a reset it is 0 until the next step. If ``frame`` is fixed to its parent and carries no mass,
    the sensor is in the next joint above that carries some. If a sample is lost, the last one is read again.
    """

    type_name: ClassVar[str] = "force_torque"
    instrument: ClassVar[str] = "frobs_core.sensors.force_torque:ForceTorqueInstrument"
    unit: ClassVar[str] = "N, N·m"
    needs: ClassVar[str] = "force_torque"

    @property
    def width(self) -> int:
        """Three of the force, three of the torque."""
        return 6

    @property
    def summary(self) -> str:
        """What it measures."""
        return "force, torque"


SENSORS: tuple[type[Sensor], ...] = (Lidar, Bumper, Imu, ForceTorque)
"""The types of sensors that there are."""
