"""Controller whose actions are complete motions, planned around obstacles and followed at the physics rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_controllers_planning.plan import Plan, Reason, ToolGoal
from frobs_controllers_planning.planner import Planner, Pose
from frobs_core.contracts import CommandMode, Controller, JointGroup, Simulation, Snapshot
from frobs_core.description import Scene
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError, UnsuitableRobotError

TARGETS = ("joint", "tcp")
"""Valid values of ``target``."""


class TrajectoryController(Controller):
    """Controller that moves the robot from rest to rest along a collision-free path within each control step.

    With ``target="joint"``, an action specifies joint positions: −1 is the lower limit and 1 the upper limit. A joint
    without limits uses the range [−π, π]. With ``target="tcp"``, an action specifies a position of the tool center
    point, with any orientation: −1 and 1 correspond to the faces of :attr:`workspace`, a box aligned with the base's
    axes. The corners of this box, and possibly some points inside, are out of reach.

    If no plan is found, or if the planned motion would take longer than the control step, the robot does not move, and
    :meth:`info` contains the reason. The controller reads the poses of the scene's bodies when a motion begins and
    assumes that the bodies do not move. The drives follow the commands with a lag that depends on their gains. Each
    motion begins at the end of the last planned motion, not at the position to which gravity deflects the arm. Planning
    is not batched: motions are planned for one environment after another.

    Args:
        target: ``"joint"`` if actions are joint positions, or ``"tcp"`` if they are tool positions.
        clearance: Minimum distance between any two objects [m], in [0, 0.5].
        velocity_scaling: Fraction of the model file's velocity limits to use, in (0, 1].
        acceleration_scaling: Fraction of the acceleration limits to use, in (0, 1].
        max_acceleration: Acceleration limits [rad/s² or m/s²]: one value for all joints, or values by joint name. A
            joint without a value reaches its velocity limit in half a second.
        max_steps: Maximum number of path search steps.
        seed: Seed for the path search. With the same seed, planning the same motion in the same scene always produces
            the same plan.

    Attributes:
        planner: The motion planner, set by ``bind``.
        workspace: Minimum and maximum corners, (3,) [m] each, of the box of tool positions for ``target="tcp"``, in the
            base frame. Set by ``bind``. Along each axis, the box contains 90 % of the tool positions for random joint
            positions within the limits.
    """

    command_mode = CommandMode.POSITION

    def __init__(
        self,
        *,
        target: str = "joint",
        clearance: float = 0.02,
        velocity_scaling: float = 0.5,
        acceleration_scaling: float = 0.5,
        max_acceleration: float | Mapping[str, float] | None = None,
        max_steps: int = 2000,
        seed: int = 1,
    ) -> None:
        if target not in TARGETS:
            offered = ", ".join(f"'{known}'" for known in TARGETS)
            raise ParameterValueError("target", target, f"one of {offered}", "trajectory")
        self.target = target
        self._parameters: dict[str, Any] = {
            "clearance": clearance,
            "velocity_scaling": velocity_scaling,
            "acceleration_scaling": acceleration_scaling,
            "max_acceleration": max_acceleration,
            "max_steps": max_steps,
            "seed": seed,
        }
        self._scene = Scene()
        self._simulation: Simulation | None = None

    def bind_scene(self, scene: Scene, simulation: Simulation) -> None:
        """Store the scene and the simulation that contain the robot."""
        self._scene, self._simulation = scene, simulation

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints.

        Raises:
            ConfigurationError: A parameter is out of range.
            UnsuitableRobotError: The group does not contain all joints of the robot.
            UnknownNameError: ``max_acceleration`` contains a name that is not a joint.
            ModelFileError: A mesh cannot be read.
        """
        if joints.joint_names != joints.model.joint_names:
            raise UnsuitableRobotError(
                joints.robot.name,
                "has joints outside the controlled group; planning requires a group with all joints.",
                "trajectory",
            )
        self._joints = joints
        self.planner = Planner(joints.robot, self._scene, model=joints.model, tcp=joints.tcp, **self._parameters)
        self._duration = control_timestep
        self._times = np.arange(1.0, decimation + 1.0) * (control_timestep / decimation)  # (decimation,)
        self.workspace = self.planner.workspace()
        self._target = np.zeros((joints.num_envs, joints.dof))
        self._rows = np.zeros((joints.num_envs, decimation, joints.dof))
        self._info = {
            name: np.zeros(joints.num_envs)
            for name in ("plan_success", "plan_reason", "plan_time", "plan_waypoints", "motion_duration")
        }
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof if self.target == "joint" else 3,), np.float32)
        self.reset(None)

    def reset(self, mask: Mask | None) -> None:
        """Set the commanded positions to the current joint positions."""
        rows = rows_of(mask)
        self._target[rows] = self._joints.joint_positions[rows]

    def apply(self, action: Action) -> Floats:
        """Return the joint positions of whole motions, (num_envs, decimation, dof) [rad or m], within the limits."""
        for i, values in enumerate(np.clip(action, -1.0, 1.0)):
            self._look_around(i)
            plan = self._plan(i, values)
            if plan.trajectory is None:
                self._rows[i] = self._target[i]
            else:
                self._rows[i] = plan.trajectory.sample(self._times)[0]
                self._target[i] = self._rows[i, -1]
            self._tell(i, plan)
        return np.clip(self._rows, self.planner.lower, self.planner.upper, out=self._rows)

    def _plan(self, i: int, action: Floats) -> Plan:
        """Plan a motion in environment ``i`` that ends within the control step."""
        planner = self.planner
        if self.target == "joint":
            half_range = 0.5 * (planner.upper - planner.lower)
            goal = np.clip(planner.lower + half_range * (action + 1.0), planner.lower, planner.upper)
            plan = planner.plan(self._target[i], goal)
        else:
            low, high = self.workspace
            pos = low + 0.5 * (high - low) * (action + 1.0)
            plan = planner.plan(self._target[i], ToolGoal(planner.in_world(pos)))
        if plan.trajectory is not None and plan.trajectory.duration > self._duration:
            return replace(plan, reason=Reason.TOO_LONG, trajectory=None)
        return plan

    def _look_around(self, i: int) -> None:
        """Update the planner with the current poses in environment ``i``."""
        if self._simulation is None:
            return
        bodies: dict[str, Pose] = {}
        for name in self.planner.obstacles:
            robot, _, link = name.partition("/")
            if name in self._scene.bodies:
                pos, quat = self._simulation.bodies[name].pose
            else:
                pos, quat = self._simulation.robots[robot].frame_pose(link)
            bodies[name] = pos[i], quat[i]
        pos, quat = self._joints.base_pose
        self.planner.place(bodies, (pos[i], quat[i]))

    def _tell(self, i: int, plan: Plan) -> None:
        info = self._info
        info["plan_success"][i] = float(plan.success)
        info["plan_reason"][i] = float(plan.reason)
        info["plan_time"][i] = plan.seconds
        info["plan_waypoints"][i] = 0.0 if plan.path is None else len(plan.path)
        info["motion_duration"][i] = 0.0 if plan.trajectory is None else plan.trajectory.duration

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return metrics of the latest planning attempt, (num_envs,) each.

        The metrics are ``plan_success`` (0 or 1), ``plan_reason`` (a value of
        :class:`~frobs_controllers_planning.plan.Reason`), ``plan_time`` [s], ``plan_waypoints`` (number of waypoints: 2
        for a straight line in joint space, 0 for no path), and ``motion_duration`` [s] (0 if the robot does not move).
        """
        return self._info

    def stored_arrays(self) -> Snapshot:
        """Return the joint positions at the end of the last motions."""
        return {"target": self._target}
