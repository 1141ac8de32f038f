"""Floor plans read from YAML, which consist of walls, boxes, initial poses, and routes or goals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigFileError, ConfigurationError, ModelFileError, ParameterValueError
from frobs_core.util.validation import validate
from frobs_core.util.yaml import load_yaml
from frobs_models import resolve_path

BUILT_IN = ("maze", "empty", "dynamic")
"""Names of the built-in floor plans."""

_MARGIN = 10.0  # [m] margin around all elements of a plan that does not define its area


Positive = Annotated[FiniteFloat, Field(gt=0.0)]
Point = tuple[FiniteFloat, FiniteFloat]


class _Element(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Box2d(_Element):
    """Axis-aligned rectangle.

    Attributes:
        low: Corner with the minimum x and y [m].
        high: Corner with the maximum x and y [m].
    """

    low: Point
    high: Point

    @model_validator(mode="after")
    def _is_one(self) -> Box2d:
        if not all(a <= b for a, b in zip(self.low, self.high, strict=True)):
            raise ValueError(f"low {self.low} must not exceed high {self.high} in any coordinate")
        return self


class Wall(_Element):
    """Straight wall, defined either by its two ends or by a center, a length and a direction.

    Attributes:
        from_: First end of the wall [m], named ``from`` in YAML.
        to: Second end of the wall [m].
        centre: Center of the wall [m], as an alternative to the two ends.
        length: Length of the wall [m], required with a center.
        along: Direction of the wall, required with a center: ``"x"``, ``"y"``, or the angle from the x axis [deg].
        thickness: Thickness of the wall [m], or None for the plan's default.
        height: Height of the wall [m], or None for the plan's default.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    from_: Point | None = Field(None, alias="from")
    to: Point | None = None
    centre: Point | None = None
    length: Positive | None = None
    along: Literal["x", "y"] | FiniteFloat | None = None
    thickness: Positive | None = None
    height: Positive | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Wall:
        ends, middle = (self.from_, self.to), (self.centre, self.length, self.along)
        given = [part is not None for part in (*ends, *middle)]
        if given not in ([True] * 2 + [False] * 3, [False] * 2 + [True] * 3):
            raise ValueError("a wall requires either 'from' and 'to', or 'centre', 'length' and 'along'")
        if self.from_ is not None and self.from_ == self.to:
            raise ValueError("the two ends of a wall must be different points")
        return self

    @property
    def middle(self) -> tuple[Point, float, float]:
        """The wall's center [m], length [m], and angle from the x axis [rad]."""
        if self.from_ is not None and self.to is not None:
            (x0, y0), (x1, y1) = self.from_, self.to
            return ((x0 + x1) / 2, (y0 + y1) / 2), math.hypot(x1 - x0, y1 - y0), math.atan2(y1 - y0, x1 - x0)
        assert self.centre is not None
        assert self.length is not None
        assert self.along is not None
        degrees = {"x": 0.0, "y": 90.0}.get(str(self.along), self.along)
        return self.centre, self.length, math.radians(float(degrees))


class Walls(_Element):
    """All walls of a floor plan.

    Attributes:
        pieces: The individual walls.
        thickness: Default thickness of the walls [m].
        height: Default height of the walls [m].
    """

    pieces: tuple[Wall, ...] = ()
    thickness: Positive = 0.15
    height: Positive = 2.5


class MovingBox(_Element):
    """Box on the floor that is stationary or moves back and forth along its own x axis.

    Attributes:
        pos: Position of the box's center at the start of an episode [m].
        size: Edge lengths along x, y and z [m].
        yaw: Orientation of the box [deg], or None for a random orientation in each episode.
        max_speed: Maximum speed [m/s]. In each episode, the speed is drawn from [0, ``max_speed``). If 0, the box is
            stationary.
        turn_every: Time between two reversals of the motion [s].
        first_turn: Time until the first reversal of the motion [s], or None to use ``turn_every``.
    """

    pos: Point
    size: tuple[Positive, Positive, Positive]
    yaw: FiniteFloat | None = None
    max_speed: Annotated[FiniteFloat, Field(ge=0.0)] = 0.0
    turn_every: Positive = 20.0
    first_turn: Positive | None = None


class Start(_Element):
    """Initial poses of the robot, either at a point or anywhere in a rectangle.

    Attributes:
        pos: Point at which the robot starts [m].
        low: Rectangle corner with the minimum x and y [m].
        high: Rectangle corner with the maximum x and y [m].
        yaw: Orientation of the robot [deg], or None for a random orientation.
    """

    pos: Point | None = None
    low: Point | None = None
    high: Point | None = None
    yaw: FiniteFloat | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Start:
        if (self.pos is None) == (self.low is None) or (self.low is None) != (self.high is None):
            raise ValueError("a start requires either 'pos', or 'low' and 'high'")
        if self.low is not None and self.high is not None:
            Box2d(low=self.low, high=self.high)
        return self

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Minimum and maximum corners of the rectangle, (2,) [m] each, which are identical for a point."""
        return np.array(self.pos or self.low, float), np.array(self.pos or self.high, float)


class FloorPlan(_Element):
    """Floor plan with walls, boxes, initial poses, and routes or goals.

    Attributes:
        walls: Fixed walls.
        boxes: Fixed or moving boxes.
        start: Initial poses of the robot.
        routes: Routes, each of which is a list of waypoints [m]. One route is chosen at random in each episode.
        goals: Rectangle from which a single waypoint is drawn in each episode, as an alternative to routes.
        clearance: Minimum distance from a random start or goal to the walls and boxes [m].
        area: Area that the robot must not leave. Leaving the area ends the episode. If None, the area extends 10 m
            beyond all elements of the plan.
    """

    walls: Walls = Walls()
    boxes: tuple[MovingBox, ...] = ()
    start: Start
    routes: tuple[Annotated[tuple[Point, ...], Field(min_length=1)], ...] = ()
    goals: Box2d | None = None
    clearance: Positive = 0.5
    area: Box2d | None = None

    @model_validator(mode="after")
    def _leads_somewhere(self) -> FloorPlan:
        if bool(self.routes) == (self.goals is not None):
            raise ValueError("a floor plan requires either 'routes' or 'goals'")
        low, high = self.bounds
        for what, points in {"the start": self.start.box, **self._destinations()}.items():
            for point in points:
                if not ((low <= point) & (point <= high)).all():
                    raise ValueError(f"{what} {tuple(map(float, point))} is outside the area")
        return self

    def _destinations(self) -> dict[str, Any]:
        if self.goals is not None:
            return {"the goals' corner": (self.goals.low, self.goals.high)}
        return {f"a waypoint of route {number + 1},": route for number, route in enumerate(self.routes)}

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Minimum and maximum corners of the area, (2,) [m] each."""
        if self.area is not None:
            return np.array(self.area.low), np.array(self.area.high)
        low, high = self.extent
        return low - _MARGIN, high + _MARGIN

    @property
    def extent(self) -> tuple[Floats, Floats]:
        """Minimum and maximum corners of the rectangle that encloses all elements, (2,) [m] each."""
        points = [*self.start.box, *(np.array(box.pos) for box in self.boxes)]
        points += [np.array(point) for ends in self._destinations().values() for point in ends]
        for wall in self.walls.pieces:
            centre, length, angle = wall.middle
            half = 0.5 * length * np.array([math.cos(angle), math.sin(angle)])
            points += [np.array(centre) - half, np.array(centre) + half]
        return np.min(points, axis=0), np.max(points, axis=0)


def read_floor_plan(plan: str | Path | Mapping[str, Any]) -> FloorPlan:
    """Read a floor plan.

    Args:
        plan: Name of a built-in floor plan, path of a YAML file, ``"package:path.yaml"`` for a file in an installed
            package, or the contents of such a file as a mapping.

    Raises:
        ConfigFileError: The file cannot be read, or it contains an unknown key or an invalid value. The message
            includes the file name and the line number.
        ConfigurationError: A mapping contains an unknown key or an invalid value.
    """
    if isinstance(plan, Mapping):
        return validate(FloorPlan, plan, "the floor plan")
    if not isinstance(plan, str | Path):
        raise ParameterValueError(
            "floor_plan", plan, "the name of a built-in plan, the path of a YAML file, or a mapping"
        )
    if plan in BUILT_IN:
        path = Path(str(files("frobs_tasks_navigation"))) / "plans" / f"{plan}.yaml"
    else:
        try:
            path = resolve_path(plan)
        except ModelFileError as error:
            known = ", ".join(f"'{name}'" for name in BUILT_IN)
            raise ConfigFileError(
                plan, None, f"the floor plan cannot be found: {error} The built-in plans are {known}."
            ) from error
    document = load_yaml(path)
    try:
        return validate(FloorPlan, document, f"floor plan '{path.name}'")
    except ConfigFileError:
        raise
    except ConfigurationError as error:  # errors that concern the whole file have no line number
        raise ConfigFileError(path, None, str(error)) from error
