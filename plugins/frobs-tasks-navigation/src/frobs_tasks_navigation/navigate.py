"""Navigation task: drive through waypoints to a goal, among the walls and boxes of a floor plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Control, RobotHandle, Simulation, Snapshot, StepContext, Task
from frobs_core.description import Marker, ObservationTerm, Rewards, RewardTerm, Scene
from frobs_core.sensing.sensors import Sensors
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError, UnknownNameError, UnsuitableRobotError, check_name
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import boolean, finite, non_negative, positive
from frobs_tasks_navigation import terms
from frobs_tasks_navigation.boxes import MovingBoxes
from frobs_tasks_navigation.course import Course
from frobs_tasks_navigation.floor_plan import read_floor_plan
from frobs_tasks_navigation.observation import OBSERVABLE, observable
from frobs_tasks_navigation.reset_options import checked_goal, checked_start
from frobs_tasks_navigation.scenery import build_scene


@dataclass
class Step:
    """Result of a step, relative to the waypoint that was next at the beginning of the step.

    Attributes:
        distance: Distance to the waypoint at the end of the step, (num_envs,) [m].
        bearing: Bearing of the waypoint at the end of the step, (num_envs,) [rad].
        progress: Decrease in the distance to the waypoint during the step, (num_envs,) [m].
        left: Number of remaining waypoints at the beginning of the step, including the next waypoint, (num_envs,).
        reached: Whether the waypoint is reached, (num_envs,) bool.
        bumped: Whether the robot has touched anything except the floor, (num_envs,) bool.
        outside: Whether the robot is outside the area, (num_envs,) bool.
    """

    distance: Floats
    bearing: Floats
    progress: Floats
    left: Floats
    reached: Mask
    bumped: Mask
    outside: Mask

    @classmethod
    def none(cls, num_envs: int) -> Step:
        """Return the result of a step in which nothing happens."""
        floats, flags = np.zeros((4, num_envs)), np.zeros((3, num_envs), np.bool_)
        return cls(*floats, *flags)


class Navigate(Task):
    """Task of driving through all waypoints of a route without collisions.

    The floor plan defines the walls, boxes, initial poses, and routes. A waypoint is reached when the robot is within
    the tolerance of the waypoint. The next waypoint then becomes the target. An episode terminates with success when
    the robot reaches the last waypoint. An episode also terminates if the robot touches anything except the floor (see
    ``collision_ends``) or leaves the plan's area.

    The reward depends on the reward type:

    {rewards}

    Args:
        floor_plan: Name of a built-in floor plan (``"maze"``, ``"empty"`` or ``"dynamic"``), a YAML file, or the
            contents of a YAML file as a mapping.
        tolerance: Distance between the robot and a waypoint within which the waypoint is considered reached [m].
        observation: Names of the observation terms, in the order of the observation. The available terms are
            ``distance``, ``bearing``, ``direction``, ``position``, ``yaw``, ``way_point``, ``velocity``, ``lidar`` and
            ``nearness`` (1 m / (1 m + range) for each lidar ray).
        lidar: Name of the robot's lidar.
        bumper: Name of the robot's bumper, which detects contacts with anything except the floor.
        collision_ends: Whether a collision ends the episode.
        progress_weight: Reward for each meter of progress toward the waypoint [1/m].
        way_point_reward: Reward at each waypoint except the last.
        goal_reward: Reward at the last waypoint.
        collision_penalty: Penalty for each step in which the robot collides or is outside the area.
        time_penalty: Penalty for each step.

    Attributes:
        plan: The parsed floor plan.
        last_step: Result of the last step.

    Raises:
        ConfigFileError: The floor plan is invalid. The message includes the file name and the line number.
        ConfigurationError: A value is out of range.
    """

    reset_options: ClassVar[Sequence[str]] = ("goal", "start")
    robots: ClassVar[Sequence[str]] = ("robot",)
    control_timestep: ClassVar[float] = 0.2
    physics_timestep: ClassVar[float] = 0.02
    late_terms: ClassVar[Sequence[str]] = ("way_point",)
    success_rule: ClassVar[str] = "the robot is within the tolerance of the last waypoint and has not collided"
    instruction: ClassVar[str] = "Drive through all waypoints to the goal without touching anything."
    rewards: ClassVar[Rewards] = {
        "dense": {
            "progress": RewardTerm(
                function=lambda task: task.last_step.progress,
                weight="progress_weight",
                meaning="d before the step − d after it, where d is the distance to the next waypoint",
                unit="m",
            ),
            "way_point": RewardTerm(
                function=lambda task: task.last_step.reached & ~task.is_success(),
                weight="way_point_reward",
                meaning="1 at each waypoint except the last",
            ),
            "goal": RewardTerm(
                function=lambda task: task.is_success(), weight="goal_reward", meaning="1 at the last waypoint"
            ),
            "collision": RewardTerm(
                function=lambda task: task.last_step.bumped | task.last_step.outside,
                weight="-collision_penalty",
                meaning="1 if the robot touches anything except the floor or is outside the area",
            ),
            "time": RewardTerm(
                function=lambda task: np.ones(len(task.is_success())),
                weight="-time_penalty",
                meaning="1 at every step",
            ),
        },
        "sparse": {"goal": RewardTerm(function=lambda task: task.is_success(), meaning="1 at the last waypoint")},
    }

    area_ends: ClassVar[bool] = True
    """Whether an episode ends when the robot leaves the plan's area."""

    def __init__(
        self,
        *,
        floor_plan: str | Path | Mapping[str, Any] = "maze",
        tolerance: float = 0.5,
        observation: Sequence[str] = ("distance", "direction", "velocity", "lidar"),
        lidar: str = "lidar",
        bumper: str = "bumper",
        collision_ends: bool = True,
        progress_weight: float = 1.0,
        way_point_reward: float = 2.0,
        goal_reward: float = 10.0,
        collision_penalty: float = 15.0,
        time_penalty: float = 0.05,
    ) -> None:
        self.plan = read_floor_plan(floor_plan)
        self.tolerance = positive("tolerance", tolerance)
        if isinstance(observation, str) or not isinstance(observation, Sequence):
            raise ParameterValueError("observation", observation, "a list of names of observation terms")
        self._observed = tuple(observation)
        for name in self._observed:
            check_name("term of the observation", name, OBSERVABLE)
        if not self._observed or len(set(self._observed)) < len(self._observed):
            raise ParameterValueError(
                "observation", list(observation), "a list of at least one observation term, without duplicates"
            )
        self.lidar, self.bumper = lidar, bumper
        self.collision_ends = boolean("collision_ends", collision_ends)
        self.progress_weight = finite("progress_weight", progress_weight)
        self.way_point_reward = finite("way_point_reward", way_point_reward)
        self.goal_reward = finite("goal_reward", goal_reward)
        self.collision_penalty = non_negative("collision_penalty", collision_penalty)
        self.time_penalty = non_negative("time_penalty", time_penalty)
        self.reward_type = self.reward_types[0]

    def scene(self) -> Scene:
        """Return a scene with the walls, the boxes, and a camera that sees the whole floor plan."""
        return build_scene(self.plan)

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Bind the task to a simulation.

        Raises:
            ConfigurationError: The robot cannot drive, or it does not have the required lidar.
        """
        self._simulation = simulation
        self._robot: RobotHandle = control.robot("robot")
        name = self._robot.robot.name
        if self._robot.robot.base == "fixed":
            raise UnsuitableRobotError(
                name, "has a fixed base, so it cannot drive; set base='wheeled' if it has wheels."
            )
        sees = not {"lidar", "nearness"}.isdisjoint(self._observed)
        if sees and self.lidar not in self._robot.robot.lidars:
            raise UnknownNameError(f"lidar of robot '{name}'", self.lidar, self._robot.robot.lidars)
        self._sensors = Sensors(simulation, control_timestep, names=[self.bumper, *([self.lidar] if sees else [])])
        n = simulation.num_envs
        self._height = self._robot.base_pose[0][:, 2:].copy()
        self._boxes = MovingBoxes(self.plan.boxes, simulation)
        self._course = Course(self.plan, n, self.tolerance)
        self._low, self._high = self.plan.bounds
        self._pos: Floats = np.zeros((n, 2))
        self._yaw, self._bearing, self._distance = np.zeros((3, n))
        self._direction, self._forward_and_turn = np.zeros((2, n, 2))
        self.last_step = Step.none(n)
        self._success: Mask = np.zeros(n, np.bool_)
        self._failed: Mask = np.zeros(n, np.bool_)

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Place the robot and the boxes, and choose a route.

        Args:
            mask: The environments to reset.
            rng: Random source, of which the streams ``"start"``, ``"heading"``, ``"route"``, ``"goal"``, ``"box_yaw"``
                and ``"box_speed"`` are used.
            options: Optional ``start``, (num_envs, 3) as x, y [m] and yaw [rad], and ``goal``, (num_envs, 2) [m]. If a
                goal is given, it is the only waypoint.

        Raises:
            ConfigurationError: A start or a goal is outside the plan's area.
        """
        rows = rows_of(mask)
        self._boxes.begin(mask, rng)
        start, goal = options.get("start"), options.get("goal")
        pos, yaw = self._course.begin(
            mask,
            rng,
            (self._boxes.pos[..., :2], self._boxes.yaw, self._boxes.half),
            (
                None if start is None else checked_start(start[rows], self._low, self._high),
                None if goal is None else checked_goal(goal[rows], self._low, self._high),
            ),
        )
        self._robot.write_base_pose(np.concatenate([pos, self._height[rows]], axis=1), terms.quat_of(yaw), mask)
        self._success[rows] = self._failed[rows] = False
        for values in vars(self.last_step).values():
            values[rows] = 0
        self._sensors.reset(mask, rng)
        self._locate()
        self._aim()

    def advance(self, context: StepContext) -> None:
        """Move the boxes, and update the quantities that the observation, the reward and the termination use."""
        self._boxes.move()
        self._sensors.advance(context.rng)
        before = self._distance
        self._locate()
        self._aim()
        step = self.last_step = Step(
            distance=self._distance,
            bearing=self._bearing,
            progress=before - self._distance,
            left=self._course.left,
            reached=self._distance <= self.tolerance,
            bumped=self._sensors.read(self.bumper)[:, 0] > 0.5,
            outside=terms.outside(self._pos, self._low, self._high),
        )
        self._fail()
        step.reached &= ~self._failed
        if step.reached.any():
            self._success = self._course.advance(step.reached)
            self._aim()  # update the distance and bearing for the next waypoint
        else:
            self._success = step.reached

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms listed in ``observation``, in SI units."""
        reads = {
            "distance": lambda: self._distance[:, None],
            "bearing": lambda: self._bearing[:, None],
            "direction": self._read_direction,
            "position": lambda: self._pos,
            "yaw": lambda: self._yaw[:, None],
            "way_point": lambda: self._course.target,
            "velocity": self._velocity,
            "lidar": lambda: self._sensors.read(self.lidar),
            "nearness": lambda: terms.nearness(self._sensors.read(self.lidar)),
        }
        known = observable(reads, self._low, self._high, self._robot.robot.lidars.get(self.lidar))
        return {name: known[name] for name in self._observed}

    def is_terminated(self) -> Mask:
        """Return whether each robot is at the last waypoint, has collided, or has left the area, (num_envs,) bool."""
        return self._success | self._failed

    def is_success(self) -> Mask:
        """Return whether each robot is at the last waypoint, (num_envs,) bool."""
        return self._success

    def set_goal(self, position: Floats, mask: Mask | None = None) -> None:
        """Make ``position``, (n, 3) [m] in the world frame, of which z is ignored, the only waypoint.

        Raises:
            ConfigurationError: A goal is outside the plan's area.
        """
        goal = checked_goal(np.asarray(position, float)[:, :2], self._low, self._high)
        self._course.set_goal(goal, rows_of(mask))
        self._aim()

    def markers(self) -> Sequence[Marker]:
        """Return markers for the waypoints, for the tolerance around the next waypoint, and for the robot."""
        way = np.concatenate([self._course.way, np.zeros((*self._course.way.shape[:2], 1))], axis=-1)
        beacons = [Marker(way[:, i], 0.15, (0.95, 0.75, 0.15, 1.0), "way_points") for i in range(way.shape[1])]
        target = np.concatenate([self._course.target, np.zeros((len(way), 1))], axis=-1)
        # The marker is above the robot, so that it is visible in an image of the whole plan.
        above = self._robot.base_pose[0] + np.array([0.0, 0.0, 0.4])
        return (*beacons, Marker(target, self.tolerance), Marker(above, 0.2, (0.85, 0.12, 0.25, 1.0), "robot"))

    def snapshot(self) -> Snapshot:
        """Return the routes, the boxes, and the result of the last step."""
        return {
            **self._course.snapshot(),
            **self._boxes.snapshot(),
            **self._sensors.snapshot(),
            **{f"step/{name}": values.copy() for name, values in vars(self.last_step).items()},
            "success": self._success.copy(),
            "distance": self._distance.copy(),
        }

    def restore(self, snapshot: Snapshot) -> None:
        self._course.restore(snapshot)
        self._boxes.restore(snapshot)
        self._sensors.restore(snapshot)
        self.last_step = Step(**{field.name: snapshot[f"step/{field.name}"].copy() for field in fields(Step)})
        self._fail()
        self._success = snapshot["success"].copy()
        self._distance = snapshot["distance"].copy()

    # -- Helpers --

    def _fail(self) -> None:
        """Determine which episodes have failed in this step."""
        step = self.last_step
        if self.area_ends:
            self._failed = step.bumped | step.outside if self.collision_ends else step.outside
        else:
            self._failed = step.bumped if self.collision_ends else np.zeros_like(step.bumped)

    def _locate(self) -> None:
        pos, quat = self._robot.base_pose
        self._pos, self._yaw = pos[:, :2], terms.yaw_of(quat)

    def _aim(self) -> None:
        offset = self._course.target - self._pos
        self._distance = terms.distance(offset)
        self._bearing = terms.bearing(offset, self._yaw)

    def _read_direction(self) -> Floats:
        """Return the cosine and sine of the bearing, (num_envs, 2)."""
        np.cos(self._bearing, out=self._direction[:, 0])
        np.sin(self._bearing, out=self._direction[:, 1])
        return self._direction

    def _velocity(self) -> Floats:
        """Return the forward velocity [m/s] and yaw rate [rad/s], (num_envs, 2)."""
        linear, angular = self._robot.base_twist
        velocity = self._forward_and_turn
        velocity[:, 0] = np.cos(self._yaw) * linear[:, 0] + np.sin(self._yaw) * linear[:, 1]
        velocity[:, 1] = angular[:, 2]
        return velocity
