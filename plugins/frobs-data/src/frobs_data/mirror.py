"""An environment whose robot is put where a real robot was measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, Snapshot
from frobs_core.kernel.env import RobotEnv
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import RunError
from frobs_core.util.rotations import quat_rotate
from frobs_data.layout import Feature
from frobs_data.recorded_features import ENVIRONMENT_STATE, STATE, Vectors, picture_features

MEASURED_TERMS = frozenset(("joint_positions", "joint_velocities", "joint_efforts", "gripper_opening")) | {
    *("tcp_position", "tcp_velocity", "tcp_pose", "achieved_goal")
}
"""Observation terms that follow from the measured joints."""

GOAL_TERMS = frozenset(("goal", "desired_goal", "goal_offset", "goal_from_shoulder"))
"""Observation terms that follow from the measured joints and the goal."""

_HALVINGS = 30
_EQUAL, _SMALL = 1e-9, 1e-6
_REACHED = 1e-3  # [rad or m, or a velocity or effort] commands that differ less are reached


class Mirror:
    """An environment whose robot is put where a real robot was measured, to compute observations, rewards and actions.

    Args:
        env: The environment, which may be wrapped.

    Attributes:
        env: The environment without wrappers.
        joint_names: Joints of the robot.
        arm: Columns of the joints that are not fingers.
        images: Observation keys of images, with their sizes in pixels.
        sizes: Number of elements of each vector term of the observation.
        features: Features of the observation.
        has_goal: Whether a reset accepts a goal.
        judges: Whether the robot and the goal determine reward and success, because the scene contains no bodies.

    Raises:
        RunError: The environment has several robots, a mobile or paced one, or depth images.
    """

    def __init__(self, env: Any) -> None:
        base = env.unwrapped
        if not isinstance(base, RobotEnv) or len(base.control.robots) != 1 or base.simulation.pacer is not None:
            rule = "one robot, on a simulator that is not paced, such as mujoco"
            raise RunError(f"only an environment with {rule}, can follow measurements; choose another one.")
        self.env, self.robot = base, base.robot
        if self.robot.robot.base != "fixed":
            raise RunError(f"measurements of mobile robots such as '{self.robot.robot.name}' cannot be followed.")
        self.joint_names = self.robot.joint_names
        tool = self.robot.robot.end_effector_of()
        fingers = self.robot.robot.groups[tool.group] if tool is not None and tool.group else ()
        self.arm = [i for i, name in enumerate(self.joint_names) if name not in fingers]
        terms = base.observations.terms
        others = [name for name, term in terms.items() if not term.is_vector and term.dtype != "uint8"]
        if others:
            raise RunError(
                f"the images {', '.join(others)} do not have the colors red, green and blue; use an environment without them."
            )
        self.images = {name: term.low.shape[:2] for name, term in terms.items() if not term.is_vector}
        self.sizes = {name: len(term.low) for name, term in terms.items() if term.is_vector}
        self.features: dict[str, Feature] = {
            **Vectors(base.observations).features,
            **picture_features({}, base.observations),
        }
        self.has_goal = "goal" in base.task.reset_options
        self.judges = not base.simulation.bodies
        base.reset(seed=0)

    @cached_property
    def fingers(self) -> list[int]:
        """Columns of the fingers that a controller moves."""
        return [i for i in self._axes[0] if i not in self.arm]

    @cached_property
    def mode(self) -> CommandMode:
        """Mode of the arm's commands.

        Raises:
            RunError: The actions of the controller cannot be computed from joint commands.
        """
        modes = {self.robot.command_modes[i] for i in self._axes[0] if i in self.arm}
        if len(modes) > 1:
            raise RunError("the joints of the arm have different command modes; choose another controller.")
        return next(iter(modes), CommandMode.POSITION)

    def begin(self, joints: Floats, goal: Floats | None) -> Snapshot:
        """Begin an episode, and return its start state.

        Args:
            joints: Positions, velocities and efforts, (3, dof).
            goal: (3,) [m] in the world frame, or None.

        Raises:
            ConfigurationError: The goal is out of reach.
        """
        self.env.reset(seed=0, options={"goal": goal} if self.has_goal and goal is not None else None)
        self.place(joints, None)
        self.env.control.reset(None)
        return self.env.snapshot()

    def place(self, joints: Floats, goal: Floats | None) -> None:
        """Put the robot and the goal where they were measured. For the arguments, see :meth:`begin`."""
        self._efforts = joints[2]
        self.robot.write_joint_state(joints[None, 0], joints[None, 1])
        if goal is not None and self.has_goal:
            self.env.task.set_goal(goal[None])
        self.env.task.advance(self.env.step_context)

    def observe(self, named: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return the vector features, where ``named`` contains terms that the robot's topics report."""
        parts: dict[str, list[Floats]] = {}
        for name, size in self.sizes.items():
            term = self.env.observations.terms[name]
            value = named.get(name)
            if value is None or len(value) != size:
                value = self._efforts if name == "joint_efforts" else term.read()[0]
            parts.setdefault(STATE if term.proprioceptive else ENVIRONMENT_STATE, []).append(value)
        return {feature: np.concatenate(values, dtype=np.float32) for feature, values in parts.items()}

    def split(self, feature: str, values: Floats) -> dict[str, Floats]:
        """Return the terms that a vector feature contains, (n, size) each, for its values (n, k)."""
        terms = self.env.observations.terms
        found, start, flat = {}, 0, values.reshape(len(values), -1)
        for name, size in self.sizes.items():
            if (STATE if terms[name].proprioceptive else ENVIRONMENT_STATE) == feature:
                found[name] = flat[:, start : start + size]
                start += size
        return found

    def judge(self) -> tuple[float, bool]:
        """Return the reward and the success of the current state."""
        task = self.env.task
        return float(task.reward(self.env.step_context)[0]), bool(task.is_success()[0])

    def act(self, command: Floats) -> tuple[Floats, bool]:
        """Return the action whose command is nearest to a recorded one, and continue from it.

        Args:
            command: Command of all joints, (dof,).

        Returns:
            The action, (k,) float32, and whether its command differs from the recorded one.
        """
        before, (columns, signs) = self.env.control.snapshot(), self._axes
        size = len(columns)
        ends = [self._respond(np.full(size, end), before) for end in (-1.0, 0.0, 1.0)]
        requested = command[columns] * signs
        target = np.clip(requested, ends[0], ends[2])
        # At a limit, several actions have the same command: take the one that is nearest to 0.
        first = self._bisect(before, lambda commands: commands < target - _EQUAL)
        last = self._bisect(before, lambda commands: commands <= target + _EQUAL)
        action = np.clip(0.0, first, np.maximum(first, last))
        # A command that jumps at 0 is that of a gripper which only opens or closes.
        jumps = (np.abs(action) < _SMALL) & (np.abs(ends[1] - target) > 1e-3 * (ends[2] - ends[0]))
        action = np.where(jumps, np.sign(target - ends[1]), action).astype(np.float32)
        return action, bool((np.abs(self._respond(action.astype(float), before) - requested) > _REACHED).any())

    def _bisect(self, before: Snapshot, is_below: Callable[[Floats], np.ndarray[Any, Any]]) -> Floats:
        """Return the action at which ``is_below``, a function of the commands, stops being true, (k,)."""
        low, high = -np.ones(len(self._axes[0])), np.ones(len(self._axes[0]))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            below = is_below(self._respond(middle, before))
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return 0.5 * (low + high)

    def in_world(self, points: Floats) -> Floats:
        """Return points of the robot's root frame in the world frame, (n, 3) [m] each."""
        position, quat = self.robot.base_pose
        return np.asarray(position + quat_rotate(quat, points))

    def _respond(self, action: Floats, before: Snapshot) -> Floats:
        """Return the commands of the joints that an action in [−1, 1] moves, each increasing with its element, (k,)."""
        self.env.control.restore(before)
        (command,) = self.env.control.commands(action[None])
        row = command[0] if command.ndim == 2 else command[0, -1]
        return np.asarray(row[self._axes[0]] * self._axes[1])

    @cached_property
    def _axes(self) -> tuple[list[int], Floats]:
        """Return the joint that each element of the action moves, and whether its command grows (1) or falls (−1)."""
        control, space = self.env.control, self.env.action_space
        columns: list[int] = []
        signs: list[float] = []
        moved: set[int] = set()
        supported = not control.physics_rate and space.shape is not None and len(space.shape) == 1
        before = control.snapshot()
        for i in range(space.shape[0] if supported and space.shape else 0):
            rows = []
            for value in (-1.0, 1.0):
                control.restore(before)
                action = np.zeros((1, *(space.shape or ())))
                action[0, i] = value
                rows.append(np.array(control.commands(action)[0], float).reshape(-1, len(self.joint_names))[-1])
            changed = np.flatnonzero(np.abs(rows[1] - rows[0]) > 1e-9).tolist()
            supported &= bool(changed) and not moved & set(changed)
            moved |= set(changed)
            columns += changed[:1]
            signs += [float(np.sign(rows[1] - rows[0])[changed[0]])] if changed else []
        control.restore(before)
        if not supported or not columns:
            names = "joint_position, joint_delta_position, joint_velocity or joint_effort"
            raise RunError(
                f"the actions of this environment's controller cannot be computed from joint commands; choose {names}, "
                "for example with --set environment_kwargs.controller=joint_position"
            )
        return columns, np.array(signs)
