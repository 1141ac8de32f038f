"""Base classes of manipulation tasks, in which an arm with a gripper works above an area of the floor."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Control, Simulation, Snapshot, StepContext, Task
from frobs_core.description import Body, Camera, Marker, ObservationTerm, Scene
from frobs_core.models import Box, Pose
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import number_list, positive, whole_number
from frobs_tasks_manipulation.of_0_2 import keep_names_of_0_2
from frobs_tasks_manipulation.reachable import workspace_of
from frobs_tasks_manipulation.rewards import length
from frobs_tasks_manipulation.tool import Grasp, Tool
from frobs_tasks_manipulation.tracked import Tracked, bounded
from frobs_tasks_manipulation.working_area import WorkingArea, draw_turn, move_goal

FLOOR_FRICTION = 0.5  # with 1, a pushed cube would jam between the tool and the floor
CUBE, _BLUE = "cube", (0.16, 0.42, 0.82, 1.0)


@keep_names_of_0_2
class Manipulation(Task):
    """Base class of the manipulation tasks.

    At the start of an episode, the tool is above the center of the working area and points down. Episodes never
    terminate. An episode is successful if, at the time limit, the task's success condition has been met for the last
    ``hold_steps`` control steps.

    Args:
        center: Center (x, y) of the working area on the floor, in the world frame [m].
        area: Side length of the square working area in which objects and goals are placed [m].
        start_height: Height of the tool above the floor at the start of an episode [m].
        hold_steps: Number of control steps for which the success condition must be met.
        grasp: How the tool approaches objects: attributes of :class:`~frobs_tasks_manipulation.tool.Grasp`.

    Attributes:
        start_opening: Opening of the gripper at the start of an episode, from 0 (closed) to 1 (open).
        finger_axis: World axis along which the fingers close: ``"x"`` or ``"y"``.
        raised_by: Names of the attributes that state how far the task raises an object [m].
        working_area: Draws and checks places in the working area.
        tool: State of the tool, set by ``bind``.
        achieved: Whether the success condition is currently met, (num_envs,) bool.

    Raises:
        ConfigurationError: A value is out of range.
    """

    robots: ClassVar[Sequence[str]] = ("robot",)
    fitting: ClassVar[str] = "frobs_tasks_manipulation.fit:fit_task"
    physics_timestep: ClassVar[float] = 0.004
    start_opening: ClassVar[float] = 1.0
    finger_axis: ClassVar[str] = "y"
    raised_by: ClassVar[Sequence[str]] = ()

    def __init__(
        self,
        *,
        center: Sequence[float] = (0.5, 0.0),
        area: float = 0.3,
        start_height: float = 0.15,
        hold_steps: int = 5,
        grasp: Mapping[str, Any] | None = None,
    ) -> None:
        self.center = np.array(number_list("center", center, 2))
        self.area = positive("area", area, "m")
        self.start_height = positive("start_height", start_height, "m")
        self.hold_steps = whole_number("hold_steps", hold_steps, 1)
        self.grasp = Grasp.read(grasp)
        self.working_area = WorkingArea(self.center, self.area)
        self.reward_type = self.reward_types[0]

    def reset_needs(self, options: Collection[str] = ()) -> Mapping[str, Level]:
        """Return the capability ``teleport``, because each reset places the arm and the objects."""
        return {"teleport": Level.APPROXIMATE}

    def cameras(self) -> dict[str, Camera]:
        """Return a camera that shows the whole arm, and one that views the working area from the front right."""
        x, y = self.center.tolist()
        overview = Camera(pos=(x + 0.75, y - 0.75, 0.65), target=(x - 0.1, y, 0.12), fov_y=42.0)
        return {"whole": self.working_area.whole_view(), "overview": overview}

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Bind the task to a simulation.

        Raises:
            UnsuitableRobotError: The robot has no gripper, or its tool cannot reach the working area.
        """
        self._simulation, self.num_envs = simulation, simulation.num_envs
        self.tool = Tool(control.robot("robot"), control.controllers, self.start_opening, workspace_of(self))
        self._held = np.zeros(self.num_envs, np.int64)
        self._bind_objects()

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Place the arm, the objects and the goal.

        Raises:
            ResetOptionError: A value in the options has a wrong shape, or is not a possible place.
        """
        rows = rows_of(mask)
        self.tool.place(mask)
        self._place_objects(mask, rng, {name: values[rows] for name, values in options.items()})
        self._held[rows] = 0
        self._update()

    def advance(self, context: StepContext) -> None:
        """Measure the states of the tool and the objects, and count the steps in which the success condition is met."""
        self._update()
        self._held[:] = (self._held + 1) * self.achieved

    def _update(self) -> None:
        self.tool.read()
        self._measure()
        self.achieved = self._is_achieved()

    def is_success(self) -> Mask:
        """Return whether the success condition has been met for ``hold_steps`` steps, (num_envs,) bool."""
        return self._held >= self.hold_steps

    def stored_arrays(self) -> Snapshot:
        """Return the number of steps for which the success condition has been met."""
        return {"held": self._held}

    def restore(self, snapshot: Snapshot) -> None:
        super().restore(snapshot)
        self._update()

    @abstractmethod
    def _bind_objects(self) -> None:
        """Store the handles of the objects, and allocate the arrays of measured values."""

    @abstractmethod
    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        """Place the objects and the goal at the positions in the options, (n, 3) each, or at random positions."""

    @abstractmethod
    def _measure(self) -> None:
        """Measure the values that the observation, the reward and the success condition use."""

    @abstractmethod
    def _is_achieved(self) -> Mask:
        """Return whether the measured values meet the success condition, (num_envs,) bool."""


class ObjectTask(Manipulation):
    """Base class of tasks in which one object, usually a cube, must be brought to a goal.

    Args:
        size: Edge length of the cube [m].
        mass: Mass of the cube [kg].
        friction: Sliding friction coefficient of the cube.
        tolerance: Maximum distance between the cube's center and the goal at which the goal is considered reached [m].
        max_speed: Maximum speed at which the cube is considered to be at rest [m/s].
        keywords: Further parameters, which are passed to :class:`Manipulation`.

    Attributes:
        body_name: Name of the object in the scene, the observation and the reset options.
        shows_goal: Whether the observation and rendered images contain the goal.
        goal_clearance: Minimum initial horizontal distance from the cube to the goal, in multiples of the tolerance.
        rest_height: Height of the object's center when the object is on the floor [m].
        to_cube, to_goal: Distances from the tool to its grip position and from the cube to the goal, (num_envs,) [m].
        speed: Speed of the cube, (num_envs,) [m/s].
    """

    reset_options: ClassVar[Sequence[str]] = ("cube_position", "goal")
    late_terms: ClassVar[Sequence[str]] = ("cube_offset_near", "goal_offset_near")
    shows_goal: ClassVar[bool] = True
    body_name: ClassVar[str] = CUBE
    goal_clearance: ClassVar[float] = 2.5
    set_goal = move_goal

    def __init__(
        self,
        *,
        size: float = 0.04,
        mass: float = 0.1,
        friction: float = 0.5,
        tolerance: float = 0.05,
        max_speed: float = 0.1,
        **keywords: Any,
    ) -> None:
        super().__init__(**keywords)
        self.size = positive("size", size, "m")
        self.mass, self.friction = positive("mass", mass, "kg"), positive("friction", friction)
        self.tolerance = positive("tolerance", tolerance, "m")
        self.max_speed = positive("max_speed", max_speed, "m/s")
        self.rest_height = self.size / 2

    def scene(self) -> Scene:
        """Return a scene with a cube on the floor."""
        pose, box = Pose((*self.center.tolist(), self.rest_height)), Box((self.size,) * 3)
        bodies = {self.body_name: Body(geometry=box, pose=pose, mass=self.mass, friction=self.friction, rgba=_BLUE)}
        return Scene(floor_friction=FLOOR_FRICTION, hard_contacts=True, bodies=bodies, cameras=self.cameras())

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for the tool, cube and goal, and for the offsets cube − tool and goal − cube."""
        terms = {
            **self.tool.terms(),
            **self.cube.terms(self.body_name),
            f"{self.body_name}_offset": bounded(self._offset, 2.0, "m", scale=5.0),
        }
        if self.shows_goal:
            terms["goal"] = bounded(self.goal, 2.0, "m", scale=4.0)
            terms["goal_offset"] = bounded(self._goal_offset, 2.0, "m", scale=5.0)
        return terms

    @property
    def grip(self) -> Floats:
        """Position at which the tool grips the object, (num_envs, 3) [m]."""
        return self.cube.pos

    def markers(self) -> Sequence[Marker]:
        """Return a marker at the goal, with the tolerance as its radius."""
        return (Marker(self.goal, self.tolerance),) if self.shows_goal else ()

    def stored_arrays(self) -> Snapshot:
        """Return the goal and the number of steps for which the success condition has been met."""
        return {**super().stored_arrays(), "goal": self.goal}

    def _bind_objects(self) -> None:
        self.cube = Tracked(self._simulation.bodies[self.body_name])
        self.goal, self._offset, self._goal_offset = np.zeros((3, self.num_envs, 3))

    def _measure(self) -> None:
        self.cube.read()
        self._offset[:] = self.grip - self.tool.pos
        self._goal_offset[:] = self.goal - self.cube.pos
        self.to_cube, self.to_goal = length(self._offset), length(self._goal_offset)
        self.speed = length(self.cube.velocity)

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        area, lowest, grasp = self.working_area, self.rest_height, self.grasp
        cube = area.chosen(f"{self.body_name}_position", options, area.draw("cube", rng, mask, height=lowest), lowest)
        self.cube.body.write_pose(cube, grasp.turned(draw_turn("cube_turn", rng, mask, grasp.turn), cube), mask)
        self.goal[rows_of(mask)] = area.chosen("goal", options, self._draw_goal(cube, mask, rng), lowest)

    def _is_achieved(self) -> Mask:
        return np.asarray((self.to_goal <= self.tolerance) & (self.speed <= self.max_speed))

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        """Draw goals, (n, 3) [m], given the initial positions ``cube``, (n, 3) [m]: on the floor, away from the cube."""
        apart = self.goal_clearance * self.tolerance
        return self.working_area.draw("goal", rng, mask, height=self.rest_height, apart_from=cube, distance=apart)
