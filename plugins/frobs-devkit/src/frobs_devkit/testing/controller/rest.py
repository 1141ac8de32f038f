"""The check that a controller lets every installed robot rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import gymnasium as gym
import numpy as np

from frobs_core import plugins
from frobs_core.contracts import CommandMode, Controller, JointGroup, RobotControl, Simulation, joint_groups
from frobs_core.description import Placement, Robot, Scene
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import Pose, RobotModel
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, FrobsError
from frobs_devkit.simulations import simulate
from frobs_devkit.testing.checks import NotApplicable, after, expect
from frobs_devkit.testing.controller.under_test import EARTH, ControllerUnderTest, has_zero
from frobs_devkit.testing.simulator.under_test import WEIGHTLESS

_SECONDS = 2.0
_AT_REST = 0.05  # [rad/s or m/s]


@after(
    "commands_have_their_shape",
    "action_changes_are_followed",
    "actions_matter",
    "zero_action_rests",
    "zero_action_does_not_drift",
    "parts_of_a_robot_are_controlled",
)
def installed_robots_rest(subject: ControllerUnderTest) -> None:
    """A robot that is commanded to stay does not exceed its velocity limits, and rests after 2 s, on each installed robot.

    An action of 0 commands a robot to stay. If the actions are joint positions (the controller has a
    ``max_action_change``), the current positions command it to stay.

    Position controllers, and effort controllers that compensate for gravity, are checked under gravity. Other
    controllers leave an arm's weight to the learner, so arms are weightless for them.
    """
    rested = False
    for robot, model in _robots(subject):
        for group in joint_groups(robot, model):
            try:
                _expect_rest(subject, robot, model, group)
                rested = True
            except (ConfigurationError, NotApplicable):
                continue  # the controller does not suit this group
    if not rested:
        raise NotApplicable("no action commands an installed robot to stay")


def _robots(subject: ControllerUnderTest) -> Iterator[tuple[Robot, RobotModel]]:
    """Yield the robot for the checks, or all installed robots with joints, except robots that must balance."""
    for robot in [subject.robot] if subject.robot else plugins.records("robot"):
        try:
            description = RobotConfig(robot=robot).describe()
            model = subject.model(description)
        except FrobsError:
            continue  # a fault of the robot, which is not under test
        if description.base != "floating" and model.joint_names:
            yield description, model


def _expect_rest(subject: ControllerUnderTest, robot: Robot, model: RobotModel, group: str) -> None:
    gravity = EARTH
    if robot.base == "fixed" and not _carries_weight(subject, robot, model, group):
        gravity = WEIGHTLESS
    with _placed(subject, robot, model, group, gravity) as (simulation, control, joints):
        [controller] = control.controllers.values()
        action, handle = _stay(controller, joints, subject.control_timestep), control.robot
        where = f"robot '{robot.name}', which is commanded to stay"
        for _ in range(math.ceil(_SECONDS / subject.control_timestep)):
            handle.command(control.command([action]))
            if control.physics_rate:
                simulation.step_with(subject.decimation, lambda: handle.command(control.update()))
            else:
                simulation.step(subject.decimation)
            _expect_slow(handle, handle.velocity_limit[0], f"{where}, exceeds a velocity limit")
        _expect_slow(handle, np.full(handle.dof, _AT_REST), f"{where}, does not rest after {_SECONDS:g} s")


def _expect_slow(joints: JointGroup, limit: Floats, problem: str) -> None:
    speed = np.abs(joints.joint_velocities[0])
    for name, value, highest in zip(joints.joint_names, speed.tolist(), limit.tolist(), strict=True):
        expect(
            value <= highest, f"{problem}: joint '{name}' moves at {value:.3g}, not at most {highest:.3g} per second."
        )


def _carries_weight(subject: ControllerUnderTest, robot: Robot, model: RobotModel, group: str) -> bool:
    commands = []
    for gravity in (EARTH, WEIGHTLESS):
        with _placed(subject, robot, model, group, gravity) as (_, control, joints):
            [controller] = control.controllers.values()
            if controller.command_mode is not CommandMode.EFFORT:
                return controller.command_mode is CommandMode.POSITION
            commands.append(controller.apply(_stay(controller, joints, subject.control_timestep)).copy())
    return not np.allclose(commands[0], commands[1])


def _stay(controller: Controller, joints: JointGroup, control_timestep: float) -> Floats:
    """Return the action that commands the robot to stay, (1, size)."""
    space, change = controller.action_space, controller.max_action_change
    if not has_zero(space):
        raise NotApplicable("the action space does not contain zero")
    assert isinstance(space, gym.spaces.Box)
    action = np.zeros((1, *space.shape))
    if change is not None:
        ratio = np.nan_to_num(change / (joints.velocity_limit[0] * control_timestep), posinf=0.0)
        for _ in range(math.ceil(2.0 / np.min(change, initial=1.0))):
            command = controller.apply(action).reshape(-1, joints.dof)[-1].copy()
            controller.reset(None)
            action = np.clip(action + ratio * (joints.joint_positions - command), space.low, space.high)
    return action


@contextmanager
def _placed(
    subject: ControllerUnderTest, robot: Robot, model: RobotModel, group: str, gravity: tuple[float, float, float]
) -> Iterator[tuple[Simulation, RobotControl, JointGroup]]:
    """Place a robot whose other joints hold their positions in a simulation, which is closed at the end."""
    controller, names, scene = subject.new_controller(), joint_groups(robot, model)[group], Scene(gravity=gravity)
    robot, pose = RobotConfig().place(robot, model, Pose(), on_floor=True)
    modes = dict.fromkeys(names, controller.command_mode)
    placement = Placement(robot=robot, model=model, pose=pose, command_mode=modes)
    with simulate(subject.simulator, placement, scene, physics_timestep=subject.physics_timestep) as (
        simulation,
        handle,
    ):
        controller.bind_scene(scene, simulation)
        control = RobotControl(handle, {group: controller}, subject.control_timestep, subject.decimation)
        controller.reset(None)
        yield simulation, control, handle.group(names, name=group)
