"""The planner: from where a robot is to where it should be, around what is in the way, within its limits."""

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
from frobs_core.arrays import Floats
from frobs_core.errors import ParameterValueError, UnknownNameError
from frobs_core.interfaces import Robot, Scene
from frobs_core.models import RobotModel, default_tcp, home_positions, load_model
from frobs_core.random import RandomSource
from frobs_core.robot_config import RobotConfig
from frobs_core.rotations import matrix_from_quat
from frobs_core.validation import whole_number

Pose = tuple[Floats, Floats]
"""pos (3,) [m] and quat_wxyz (4,) in the world."""

_WAYS = 3  # are looked for to joint positions of a tool goal, the nearest first
_SOLUTIONS = 4  # that are free, from which these are chosen
_TRIES = 30  # of inverse kinematics
_POSTURES = 4096  # that tell where the tool can be
_STILL = 1e-6  # [rad or m]: a motion this short is none
_LIMIT_TOLERANCE = 1e-3  # [rad or m] that a measured joint may be beyond its limit


class Planner:
    """Plans motions of one robot in a scene, without a simulation.

    The same arguments give the same plan. What may not touch is what the simulators do not let pass: the collision
    shapes of the robot's links beside each other (but for neighbours, and what overlaps at home), the bodies of the
    scene, further robots, the floor.

    Args:
        robot: Its name, the path of its model file, or its description.
        scene: What stands around it; None: a floor.
        model: Its model file, where it is read already.
        tcp: Link that tool goals talk about; None: the robot's own.
        clearance: How far everything stays from everything [m], in [0, 0.5]; what is nearer where the motion begins,
            or is always near, may come half as near again.
        velocity_scaling: Share of the model file's velocity limits that is used, in (0, 1].
        acceleration_scaling: Share of the acceleration limits that is used, in (0, 1].
        max_acceleration: Acceleration limits [rad/s² or m/s²], one for all joints or by joint name; None, and for a
            joint that is left out: what gets it to its velocity limit in half a second.
        may_touch: Pairs of links of the robot that may touch, beside those named above.
        max_steps: Of the search, before it gives up, ≥ 1.
        seed: Of what is drawn at random, ≥ 1.

    Attributes:
        joint_names: The order of joint positions.
        home: (dof,) [rad or m]
        lower: (dof,) [rad or m]; −π where there is no limit.
        upper: (dof,) [rad or m]; π where there is no limit.
        max_velocity: (dof,) [rad/s or m/s] that no motion exceeds.
        max_acceleration: (dof,) [rad/s² or m/s²] that no motion exceeds.

    Raises:
        UnknownNameError: There is no such robot, link or joint.
        ConfigurationError: A value cannot be used.
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
        if self._tcp not in links:
            raise UnknownNameError("link", self._tcp, links)
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
        """Say where things are now; what is not named stays where it was.

        Args:
            bodies: Poses in the world by name; the links of further robots are ``"robot/link"``.
            base: Of the robot's root link in the world; None: as it was.

        Raises:
            UnknownNameError: The scene has no such body, or nothing can touch it.
        """
        for name, pose in bodies.items():
            if name not in self._poses:
                raise UnknownNameError("body that can be touched", name, self._poses)
            self._poses[name] = to_se3(*pose)
        if base is not None:
            self._base = to_se3(*base)
        self._place()

    def _place(self) -> None:
        """Put everything where it is in the frame of the robot's root link."""
        into_base = self._base.inverse()
        self._checker.place({FLOOR: into_base, **{name: into_base * pose for name, pose in self._poses.items()}})

    @property
    def obstacles(self) -> tuple[str, ...]:
        """Names of what the robot can touch beside the floor, as :meth:`place` takes them."""
        return tuple(self._poses)

    def workspace(self) -> tuple[Floats, Floats]:
        """Return the lowest and the highest corner (3,) [m] of where the tool mostly is, in the root link's frame.

        Along each axis, nine in ten of the points lie between them where random joint vectors put the tool.
        """
        drawn = RandomSource(1).uniform("workspace", self.lower, self.upper, (_POSTURES, len(self.lower)))[0]
        low, high = np.percentile(self._model.frame_pose(self._tcp, drawn)[0], (5.0, 95.0), axis=0)
        return low, np.maximum(high, low)

    def tool_pos(self, joint_positions: npt.ArrayLike) -> Floats:
        """Return where the tool centre point is in the world, (3,) [m], for joint positions (dof,) [rad or m]."""
        position = self._vector("joint_positions", joint_positions, len(self.home))
        return self.in_world(self._model.frame_pose(self._tcp, position[None])[0][0])

    def in_world(self, pos: Floats) -> Floats:
        """Return where a point (3,) [m] of the root link's frame is in the world, (3,) [m]."""
        return np.asarray(self._base.act(pos))

    def plan(self, start: npt.ArrayLike, goal: npt.ArrayLike | ToolGoal, *, max_seconds: float | None = None) -> Plan:
        """Plan a motion from rest to rest.

        Args:
            start: (dof,) [rad or m]
            goal: Joint positions (dof,) [rad or m], or where the tool should be: the nearest of the joint positions
                that were found for it then is the goal, as far as a way to them is found.
            max_seconds: The search for a way also gives up after this time [s]; then the result depends on how fast the
                machine is. None: only ``max_steps`` counts.

        Returns:
            A plan, or the reason why there is none, which is no error.

        Raises:
            ConfigurationError: Start or goal has the wrong shape, or is not finite.
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
        """Return whether the robot could be told to go there: joint positions (dof,) [rad or m]."""
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
            found = self._motion(inside, joint_goal)
            if found is not None:
                return found
        return Plan(reason=Reason.NO_WAY_FOUND)

    def _joint_goal(self, goal: Floats) -> list[Floats] | Reason:
        if ((goal < self.lower) | (goal > self.upper)).any():
            return Reason.GOAL_OUTSIDE_LIMITS
        return [goal] if self._checker.is_free(goal) else Reason.GOAL_IN_COLLISION

    def _joint_goals(self, start: Floats, goal: ToolGoal) -> list[Floats] | Reason:
        """Return joint positions that put the tool at a goal, the nearest first."""
        pos = self._base.actInv(self._vector("the goal's pos", goal.pos, 3))
        rotation = None
        if goal.quat_wxyz is not None:
            quat = self._vector("the goal's quat_wxyz", goal.quat_wxyz, 4)
            if abs(float(np.linalg.norm(quat)) - 1.0) > 1e-3:
                raise ParameterValueError("length of the goal's quat_wxyz", np.linalg.norm(quat), "1")
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
