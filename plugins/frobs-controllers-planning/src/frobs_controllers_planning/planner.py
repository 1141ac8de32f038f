"""Planner for collision-free motions within a robot's limits."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
import numpy.typing as npt

from frobs_controllers_planning import limits, surroundings
from frobs_controllers_planning.collision import FLOOR, CollisionChecker
from frobs_controllers_planning.inverse_kinematics import InverseKinematics
from frobs_controllers_planning.kinematics import Kinematics, se3, to_se3
from frobs_controllers_planning.plan import Plan, Reason, ToolGoal
from frobs_controllers_planning.search import Search
from frobs_controllers_planning.timing import Rest, Timing
from frobs_core.description import Robot, Scene
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import RobotModel, default_tcp, home_positions, load_model
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, check_name
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import matrix_from_quat
from frobs_core.util.validation import whole_number

Pose = tuple[Floats, Floats]
"""Position (3,) [m] and scalar-first quaternion (4,) in the world frame."""

_WAYS = 3  # maximum number of path searches for a tool goal, beginning with the nearest joint positions
_SOLUTIONS = 4  # number of collision-free solutions from which the nearest ones are selected
_TRIES = 30  # maximum number of initial positions for inverse kinematics
_POSTURES = 4096  # number of random joint positions used to determine the tool's workspace
_STILL = 1e-6  # [rad or m]: shorter motions require no path
_LIMIT_TOLERANCE = 1e-3  # [rad or m]: measured joint positions may exceed the limits by this much


class Planner:
    """Motion planner for one robot in a scene. It works without a simulation.

    The same arguments always result in the same plan. As in the simulators, the robot's links can collide with each
    other (except for neighbors and for links that overlap at home), with the bodies of the scene, with additional
    robots, and with the floor.

    Args:
        robot: The robot: its name, the path of its model file, or its description.
        scene: Scene that surrounds the robot, or None for a scene with only a floor.
        model: Parsed model of the robot, or None to load the model file.
        tcp: Name of the link that must reach tool goals, or None for the robot's tool center point.
        clearance: Minimum distance between any two objects [m], in [0, 0.5]. If two objects are closer to each
            other at the start of a motion or at home, half of that distance is used instead.
        velocity_scaling: Fraction of the model file's velocity limits to use, in (0, 1].
        acceleration_scaling: Fraction of the acceleration limits to use, in (0, 1].
        max_acceleration: Acceleration limits [rad/s² or m/s²]: one value for all joints, or values by joint name. A
            joint without a value reaches its velocity limit in half a second.
        may_touch: Pairs of the robot's links that may touch, in addition to neighbors and links that overlap at home.
        max_steps: Maximum number of search steps, ≥ 1.
        seed: Seed for the random numbers, ≥ 1.

    Attributes:
        joint_names: Names of the actuated joints, in the order of the joint position arrays.
        home: Home positions of the joints, (dof,) [rad or m].
        lower: Lower position limits, (dof,) [rad or m], −π for joints without a limit.
        upper: Upper position limits, (dof,) [rad or m], π for joints without a limit.
        max_velocity: Maximum joint velocities of planned motions, (dof,) [rad/s or m/s].
        max_acceleration: Maximum joint accelerations of planned motions, (dof,) [rad/s² or m/s²].

    Raises:
        UnknownNameError: The robot, the tool link or a joint does not exist.
        ConfigurationError: A value is invalid.
        ModelFileError: A model file or a mesh cannot be read.
    """

    def __init__(
        self,
        robot: str | Robot,
        scene: Scene | None = None,
        *,
        model: RobotModel | None = None,
        tcp: str | None = None,
        clearance: float = 0.02,
        velocity_scaling: float = 0.5,
        acceleration_scaling: float = 0.5,
        max_acceleration: float | Mapping[str, float] | None = None,
        may_touch: Collection[tuple[str, str]] = (),
        max_steps: int = 2000,
        seed: int = 1,
    ) -> None:
        scene = Scene() if scene is None else scene
        description = RobotConfig(robot=robot, tcp=tcp).describe()
        if model is None:
            paths = description.package_paths
            model = load_model(description.model, xacro_args=description.xacro_args, package_paths=paths)
        self._tcp = description.tcp or default_tcp(model)
        links = [link.name for link in model.links]
        check_name("link", self._tcp, links)
        self._model, self.joint_names = model, model.joint_names
        self.home = home_positions(model, description.home)
        self.lower, self.upper = limits.ranges(model)
        velocity_scaling = limits.number("velocity_scaling", velocity_scaling, "1", largest=1.0)
        acceleration_scaling = limits.number("acceleration_scaling", acceleration_scaling, "1", largest=1.0)
        self.max_velocity = velocity_scaling * limits.velocities(model)
        self.max_acceleration = acceleration_scaling * limits.accelerations(model, max_acceleration)

        kinematics = Kinematics(model)
        self._checker = CollisionChecker(
            kinematics,
            surroundings.shapes(scene),
            floor=scene.floor,
            self_collision=description.self_collision,
            may_touch=may_touch,
            clearance=limits.number("clearance", clearance, "m", largest=0.5, zero=True),
        )
        self._base, self._poses = se3(scene.robot_pose), surroundings.poses(scene)
        self._place()
        self._checker.let_overlap(self.home)
        self._timing = Timing(self.max_velocity, self.max_acceleration)
        self._ik = InverseKinematics(kinematics, self._tcp, self.lower, self.upper)
        self._seed = whole_number("trajectory: seed", seed, lowest=1)
        max_steps = whole_number("trajectory: max_steps", max_steps, lowest=1)
        self._search = Search(self._checker, self.lower, self.upper, max_steps=max_steps, seed=self._seed)

    def place(self, bodies: Mapping[str, Pose], base: Pose | None = None) -> None:
        """Set the current poses of objects. Omitted objects keep their poses.

        Args:
            bodies: Poses in the world frame, by body name. Links of additional robots are named ``"robot/link"``.
            base: Pose of the robot's root link in the world frame, or None to leave the pose unchanged.

        Raises:
            UnknownNameError: A body is not part of the scene or has no collision shapes.
        """
        for name, pose in bodies.items():
            check_name("body with collision shapes", name, self._poses)
            self._poses[name] = to_se3(*pose)
        if base is not None:
            self._base = to_se3(*base)
        self._place()

    def _place(self) -> None:
        """Transform all poses into the frame of the robot's root link."""
        into_base = self._base.inverse()
        self._checker.place({FLOOR: into_base, **{name: into_base * pose for name, pose in self._poses.items()}})

    @property
    def obstacles(self) -> tuple[str, ...]:
        """Names of all obstacles except the floor, as used by :meth:`place`."""
        return tuple(self._poses)

    def workspace(self) -> tuple[Floats, Floats]:
        """Return the minimum and maximum corners, (3,) [m] each, of the tool's workspace in the root link's frame.

        Along each axis, the workspace contains 90 % of the tool positions for random joint positions.
        """
        drawn = RandomSource(1).uniform("workspace", self.lower, self.upper, (_POSTURES, len(self.lower)))[0]
        low, high = np.percentile(self._model.frame_pose(self._tcp, drawn)[0], (5.0, 95.0), axis=0)
        return low, np.maximum(high, low)

    def tool_pos(self, joint_positions: npt.ArrayLike) -> Floats:
        """Return the tool center point's position (3,) [m] in the world frame for joint positions (dof,) [rad or m]."""
        position = self._vector("joint_positions", joint_positions, len(self.home))
        return self.in_world(self._model.frame_pose(self._tcp, position[None])[0][0])

    def in_world(self, pos: Floats) -> Floats:
        """Transform a point (3,) [m] from the root link's frame to the world frame."""
        return np.asarray(self._base.act(pos))

    def plan(self, start: npt.ArrayLike, goal: npt.ArrayLike | ToolGoal, *, max_seconds: float | None = None) -> Plan:
        """Plan a motion that starts and ends at rest.

        Args:
            start: Initial joint positions, (dof,) [rad or m].
            goal: Joint positions (dof,) [rad or m], or a tool goal. For a tool goal, the planner tries several joint
                positions that reach the goal, nearest to ``start`` first, and uses the first for which it finds a path.
            max_seconds: Time limit for the path search [s], in addition to ``max_steps``, or None for no time limit.
                With a time limit, the result depends on the speed of the machine.

        Returns:
            The plan. If no motion was found, the plan contains the reason, and no error is raised.

        Raises:
            ConfigurationError: The start or the goal has the wrong shape or contains values that are not finite.
        """
        begin = perf_counter()
        self._search.deadline = math.inf if max_seconds is None else begin + max_seconds
        position = self._vector("start", start, len(self.home))
        if isinstance(goal, ToolGoal):
            plan = self._plan(position, goal)
        else:
            plan = self._plan(position, self._vector("goal", goal, len(self.home)))
        return replace(plan, seconds=perf_counter() - begin)

    def is_free(self, joint_positions: npt.ArrayLike) -> bool:
        """Return whether joint positions (dof,) [rad or m] are within the limits and respect the clearance."""
        position = self._vector("joint_positions", joint_positions, len(self.home))
        self._checker.begin_anywhere()
        within = bool(((position >= self.lower) & (position <= self.upper)).all())
        return within and self._checker.is_free(position)

    def _plan(self, start: Floats, goal: Floats | ToolGoal) -> Plan:
        inside = np.clip(start, self.lower, self.upper)
        if np.abs(inside - start).max() > _LIMIT_TOLERANCE:
            return Plan(reason=Reason.START_OUTSIDE_LIMITS)
        if not self._checker.begin_at(inside):
            return Plan(reason=Reason.START_IN_COLLISION)
        goals = self._joint_goals(inside, goal) if isinstance(goal, ToolGoal) else self._joint_goal(goal)
        if isinstance(goals, Reason):
            return Plan(reason=goals)
        for joint_goal in goals:
            motion = self._motion(inside, joint_goal)
            if motion is not None:
                return motion
        return Plan(reason=Reason.NO_WAY_FOUND)

    def _joint_goal(self, goal: Floats) -> list[Floats] | Reason:
        if ((goal < self.lower) | (goal > self.upper)).any():
            return Reason.GOAL_OUTSIDE_LIMITS
        return [goal] if self._checker.is_free(goal) else Reason.GOAL_IN_COLLISION

    def _joint_goals(self, start: Floats, goal: ToolGoal) -> list[Floats] | Reason:
        """Return joint positions that reach a tool goal, nearest to ``start`` first, or why none were found."""
        pos = self._base.actInv(self._vector("the goal's pos", goal.pos, 3))
        rotation = None
        if goal.quat_wxyz is not None:
            quat = self._vector("the goal's quat_wxyz", goal.quat_wxyz, 4)
            if abs(float(np.linalg.norm(quat)) - 1.0) > 1e-3:
                raise ParameterValueError("the norm of the goal's quat_wxyz", np.linalg.norm(quat), "1")
            rotation = self._base.rotation.T @ matrix_from_quat(quat / np.linalg.norm(quat))
        free: list[Floats] = []
        reached = False
        rng = np.random.default_rng(self._seed)
        tolerances = goal.position_tolerance, goal.rotation_tolerance
        for solution in self._ik.solutions(pos, rotation, start, rng, _TRIES, tolerances):
            reached = True
            if self._checker.is_free(solution):
                free.append(solution)
                if len(free) == _SOLUTIONS:
                    break
        if not free:
            return Reason.GOAL_IN_COLLISION if reached else Reason.GOAL_OUT_OF_REACH
        return sorted(free, key=lambda found: float((np.abs(found - start) / self.max_velocity).max()))[:_WAYS]

    def _motion(self, start: Floats, goal: Floats) -> Plan | None:
        if np.abs(goal - start).max() < _STILL:
            return Plan(reason=Reason.PLANNED, path=np.stack([start, goal]), trajectory=Rest(goal))
        path = self._search.find(start, goal)
        rounded = None if path is None else self._search.round_off(path)
        trajectory = None if rounded is None else self._timing.follow(rounded)
        return None if trajectory is None else Plan(reason=Reason.PLANNED, path=path, trajectory=trajectory)

    @staticmethod
    def _vector(name: str, values: Any, length: int) -> Floats:
        array = np.asarray(values, float)
        if array.shape != (length,) or not np.isfinite(array).all():
            raise ParameterValueError(name, values, f"{length} finite numbers")
        return array
