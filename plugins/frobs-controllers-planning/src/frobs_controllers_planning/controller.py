"""An action is one whole motion: planned around what is in the way, and followed at the physics rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_controllers_planning.plan import Plan, Reason, ToolGoal
from frobs_controllers_planning.planner import Planner, Pose
from frobs_core.arrays import Action, Floats, Mask, rows_of
from frobs_core.errors import ParameterValueError, UnsuitableRobotError
from frobs_core.interfaces import CommandMode, Controller, JointGroup, Scene, Simulation, Snapshot

TARGETS = ("joint", "tcp")
"""What ``target`` may be."""


class TrajectoryController(Controller):
    """Moves the robot from rest to rest, once in each control step, along a way that touches nothing.

    With ``target="joint"`` an action names joint positions: −1 is the lower limit, 1 the upper; a joint without limits
    turns in [−π, π]. With ``target="tcp"`` it names a point for the tool centre point, however that is turned: −1 to 1
    are the edges of :attr:`workspace`, a box along the base's axes. Its corners are out of reach, and so may be some of
    its inside.

    Where there is no plan, or its motion would take longer than the control step, the robot stays where it is, and
    :meth:`info` says why. The scene is looked at as it is when the motion begins, and taken to stay so. The drives
    follow what is commanded with the lag that their gains give; the next motion begins where the last one was to end,
    not where gravity lets the arm hang. It is not batched: environments are planned for one after the other.

    Args:
        target: ``"joint"`` or ``"tcp"``.
        clearance: How far everything stays from everything [m], in [0, 0.5].
        velocity_scaling: Share of the model file's velocity limits that is used, in (0, 1].
        acceleration_scaling: Share of the acceleration limits that is used, in (0, 1].
        max_acceleration: Acceleration limits [rad/s² or m/s²], one for all joints or by joint name; None: what gets
            each joint to its velocity limit in half a second.
        max_steps: Of the search for a way, before it gives up.
        seed: Of the search; the same motion in the same scene is planned the same way.

    Attributes:
        planner: That plans; set by ``bind``.
        workspace: Lowest and highest corner (3,) [m] of what ``target="tcp"`` reaches, in the frame of the base; set by
            ``bind``. Nine in ten of the points where joint vectors inside the limits put the tool lie in between along
            each axis.
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
        """Keep what stands around the robot."""
        self._scene, self._simulation = scene, simulation

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare for the joints to control.

        Raises:
            ConfigurationError: A parameter is out of its range.
            UnsuitableRobotError: The group lacks some of the robot's joints.
            UnknownNameError: ``max_acceleration`` names no joint.
            ModelFileError: A mesh cannot be read.
        """
        if joints.joint_names != joints.model.joint_names:
            raise UnsuitableRobotError(
                joints.robot.name, "has joints outside of the group; plan for all joints.", "trajectory"
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
        """Hold the present positions."""
        rows = rows_of(mask)
        self._target[rows] = self._joints.joint_positions[rows]

    def apply(self, action: Action) -> Floats:
        """Return the joint positions of a whole motion, (num_envs, decimation, dof) [rad or m], inside the limits."""
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
        """Return environment ``i``'s motion, if there is one that ends within the control step."""
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
        """Tell the planner where things are in environment ``i``."""
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
        """Return how the last motions were planned, (num_envs,) each.

        ``plan_success`` (0 or 1), ``plan_reason`` (a number of :class:`~frobs_controllers_planning.plan.Reason`),
        ``plan_time`` [s] that planning took, ``plan_waypoints`` of the way (2: a straight line in joint space; 0: none),
        ``motion_duration`` [s] of the motion, 0 where the robot stays.
        """
        return self._info

    def snapshot(self) -> Snapshot:
        """Return where the last motions were to end."""
        return {"target": self._target.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._target[:] = snapshot["target"]
