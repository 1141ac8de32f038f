"""Combines the controllers of an environment, so that a single action moves the joint groups of all robots."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from math import prod
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts.controller import Controller
from frobs_core.contracts.joint_group import JointSubset
from frobs_core.contracts.robot_handle import RobotHandle
from frobs_core.contracts.stateful import Stateful
from frobs_core.description import ALL, Robot
from frobs_core.models import RobotModel
from frobs_core.util.arrays import Action, Floats, Mask
from frobs_core.util.errors import IncompatibleSpaceError, MissingSettingError, UnsuitableRobotError


def joint_groups(robot: Robot, model: RobotModel) -> dict[str, tuple[str, ...]]:
    """Return a robot's joints by joint group. If the robot defines no groups, all joints belong to the group ``"all"``.

    Raises:
        UnsuitableRobotError: A group is empty, names a joint that is not actuated, or shares a joint with another
            group.
    """
    if not robot.groups:
        return {ALL: model.joint_names}
    group_of: dict[str, str] = {}
    for group, joints in robot.groups.items():
        if not joints:
            raise UnsuitableRobotError(robot.name, f"has an empty joint group '{group}'.")
        for joint in joints:
            if joint not in model.joint_names:
                known = ", ".join(model.joint_names)
                raise UnsuitableRobotError(
                    robot.name, f"has no actuated joint '{joint}' for its group '{group}'; actuated joints: {known}."
                )
            if joint in group_of:
                raise UnsuitableRobotError(
                    robot.name, f"has the joint '{joint}' in two groups, '{group_of[joint]}' and '{group}'."
                )
            group_of[joint] = group
    return {group: tuple(joints) for group, joints in robot.groups.items()}


def check_robot(owner: str, name: str, robots: Collection[str]) -> None:
    """Check that there is a controlled robot with the name that its owner needs.

    Raises:
        MissingSettingError: There is no such robot.
    """
    if name not in robots:
        advice = f"the robots are named {', '.join(robots)}; rename one of them: robots={{'{name}': …}}"
        raise MissingSettingError(owner, f"a robot named '{name}'", advice)


class RobotControl:
    """Controllers of one robot, bound to its joint groups. Joints without a controller stay at their home positions.

    Args:
        robot: Handle of the robot.
        controllers: Controllers, by joint group.
        control_timestep: [s]
        decimation: Physics steps per control step.

    Attributes:
        robot: Handle of the robot.
        controllers: Controllers, by joint group.
        physics_rate: Whether any controller of the environment computes a new command at every physics step, so that
            :meth:`update` is called.
        only: The robot's controller, if there is only one and it moves all joints at the control rate. Otherwise, None.
    """

    def __init__(
        self, robot: RobotHandle, controllers: Mapping[str, Controller], control_timestep: float, decimation: int
    ) -> None:
        self.robot, self.controllers = robot, controllers
        self._columns: list[slice | np.ndarray[Any, Any]] = []  # columns of each group in the robot's command
        groups = joint_groups(robot.robot, robot.model)
        for name, controller in controllers.items():
            group = robot.group(groups[name], name=name)
            controller.bind(group, control_timestep, decimation)
            self._columns.append(group.columns if isinstance(group, JointSubset) else slice(None))
        self.physics_rate = any(controller.rate == "physics" for controller in controllers.values())
        covers_all = self._columns == [slice(None)] and not self.physics_rate
        self.only = next(iter(controllers.values())) if covers_all else None
        # Joints without a controller keep their home positions. All other columns are overwritten at each step.
        self._held: Floats = np.repeat(robot.home[:1], robot.num_envs, axis=0)
        self._commands: list[Floats] = []
        self._physics_step = 0

    def command(self, actions: Iterable[Action]) -> Floats:
        """Return the command for all joints, given one action per controller.

        Args:
            actions: One action per controller, (num_envs, …) each.

        Returns:
            The command, (num_envs, dof), or (num_envs, decimation, dof) if a controller returns one row per physics
            step.
        """
        whole, self._physics_step, self._commands = self._held, 0, []
        for controller, columns, action in zip(self.controllers.values(), self._columns, actions, strict=True):
            command = controller.apply(action)
            self._commands.append(command)
            if command.ndim == 2:
                whole[..., columns] = command if whole.ndim == 2 else command[:, None]
            elif self.physics_rate:
                whole[:, columns] = command[:, 0]
            else:
                if whole.ndim == 2:
                    whole = np.repeat(whole[:, None], command.shape[1], axis=1)
                whole[..., columns] = command
        return whole

    def update(self) -> Floats:
        """Return the command for all joints for the next physics step, (num_envs, dof)."""
        self._physics_step += 1
        for controller, columns, command in zip(self.controllers.values(), self._columns, self._commands, strict=True):
            if controller.rate == "physics":
                self._held[:, columns] = controller.update()
            elif command.ndim == 3:
                self._held[:, columns] = command[:, self._physics_step]
        return self._held


class Control(Stateful):
    """All controllers of an environment.

    The action space combines the controllers' action spaces, in the order of the robots and their joint groups. Boxes
    are combined into one Box, and Discrete spaces into a MultiDiscrete. If there is only one controller, its action
    space is used unchanged.

    Args:
        robots: Controllers of each robot, by robot name.

    Attributes:
        robots: Controllers of each robot, by robot name.
        controllers: Controllers, by ``"robot/group"``.
        action_space: Action space of a single environment.
        physics_rate: Whether any controller computes a new command at every physics step.
        only: The controller, if there is only one and it moves all joints of the only robot at the control rate.
            Otherwise, None.
        last_commands: Latest command that :meth:`update` sent to each robot, by robot name, (num_envs, dof).

    Raises:
        IncompatibleSpaceError: The action spaces cannot be combined.
    """

    def __init__(self, robots: Mapping[str, RobotControl]) -> None:
        self.robots = dict(robots)
        self._first = next(iter(self.robots.values()))
        self.last_commands: dict[str, Floats] = {}
        self.only = self._first.only if len(self.robots) == 1 else None
        self.controllers = {
            f"{name}/{group}": controller
            for name, robot in robots.items()
            for group, controller in robot.controllers.items()
        }
        self.physics_rate = any(robot.physics_rate for robot in robots.values())
        for robot in robots.values():
            robot.physics_rate = self.physics_rate
        spaces = {name: controller.action_space for name, controller in self.controllers.items()}
        self.action_space = next(iter(spaces.values())) if len(spaces) == 1 else _join_spaces(spaces)
        # Part of the full action for each controller, by robot.
        self._parts: list[list[Any]] = []
        start = 0
        for robot in robots.values():
            parts: list[Any] = []
            for controller in robot.controllers.values():
                discrete = isinstance(controller.action_space, gym.spaces.Discrete)
                width = prod((controller.action_space.shape or ())[:1])
                parts.append((slice(None), start if discrete else slice(start, start + width)))
                start += width
            self._parts.append(parts)
        if len(self.controllers) == 1:  # its action is the full action, which may have any shape
            self._parts = [[...] if parts else [] for parts in self._parts]

    def robot(self, name: str) -> RobotHandle:
        """Return the handle of a controlled robot. Its controllers are ``robots[name].controllers``.

        Args:
            name: Name of the robot in the environment. A robot given by the keyword ``robot`` is named ``"robot"``.

        Raises:
            MissingSettingError: No controlled robot has this name.
        """
        check_robot("the task", name, self.robots)
        return self.robots[name].robot

    def commands(self, actions: Action) -> list[Floats]:
        """Return one command per robot, in the order of ``robots``.

        Args:
            actions: Actions in the batched action space, (num_envs, …).

        Returns:
            The commands, (num_envs, dof) or (num_envs, decimation, dof) each.
        """
        commands = []
        for robot, parts in zip(self.robots.values(), self._parts, strict=True):
            commands.append(robot.command(map(actions.__getitem__, parts)))
        return commands

    def update(self) -> None:
        """Command the next physics step."""
        for name, robot in self.robots.items():
            self.last_commands[name] = command = robot.update()
            robot.robot.command(command)

    def reset(self, mask: Mask | None) -> None:
        """Begin an episode in the environments selected by ``mask``. The task must already have placed the robots."""
        for controller in self.controllers.values():
            controller.reset(mask)

    @property
    def max_action_change(self) -> Floats | None:
        """Largest action change per control step that the joints can follow, with the shape of a single action.

        The value is None if the actions of any controller are not joint positions.
        """
        changes = [controller.max_action_change for controller in self.controllers.values()]
        known = [change for change in changes if change is not None]
        return np.concatenate(known) if len(known) == len(changes) else None

    def stored_parts(self) -> Mapping[str, Controller]:
        return self.controllers


def _join_spaces(spaces: Mapping[str, gym.Space[Any]]) -> gym.Space[Any]:
    boxes = [space for space in spaces.values() if isinstance(space, gym.spaces.Box) and len(space.shape) == 1]
    moves = [space for space in spaces.values() if isinstance(space, gym.spaces.Discrete) and space.start == 0]
    if len(boxes) == len(spaces):
        low, high = np.concatenate([box.low for box in boxes]), np.concatenate([box.high for box in boxes])
        return gym.spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)
    if len(moves) == len(spaces):
        return gym.spaces.MultiDiscrete([int(space.n) for space in moves])
    listed = "; ".join(f"{name}: {space}" for name, space in spaces.items())
    raise IncompatibleSpaceError(
        "the environment:",
        spaces,
        f"action spaces of different kinds cannot be combined ({listed}); use only controllers with Box spaces, or "
        "only controllers with Discrete spaces (the controller 'discrete' converts a Box space to a Discrete space).",
    )
