"""Checks of a robot's behavior in a simulator."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle, Simulation
from frobs_core.description import Contact, Scene
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_rotate
from frobs_devkit.simulations import TIMESTEP
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, expect
from frobs_devkit.testing.compare import expect_close, expect_same_pose, placed
from frobs_devkit.testing.robot.description import efforts_hold_home
from frobs_devkit.testing.robot.under_test import RobotUnderTest

# tolerated loss of speed, as a fraction, when a base drives straight ahead and when it turns
_SLIP, _SLIP_TURNING = 0.2, 0.45
_SAG = 0.05  # [rad or m], maximum deflection caused by gravity
_STOP, _REBOUND = 1e-3, 0.1  # [rad or m], [s] distance from a limit at which a joint rebounds, and time to average it


def frames_agree(subject: RobotUnderTest) -> None:
    """For joint positions within the limits, the simulator's link poses match the model file."""
    with subject.build() as (_, robot):
        model = subject.model
        expect(robot.joint_names == model.joint_names, f"joint_names is {robot.joint_names}, not {model.joint_names}.")
        low = np.maximum(robot.position_lower[0], -3.0)
        high = np.minimum(robot.position_upper[0], 3.0)
        drawn = low + (high - low) * np.random.default_rng(0).uniform(size=(5, robot.dof))
        for link in model.links:
            expected = placed(robot.base_pose, model.frame_pose(link.name, drawn))
            expect_same_pose(expected, robot.frame_pose(link.name, drawn), 1e-6, f"link '{link.name}'")


def home_is_held(subject: RobotUnderTest) -> None:
    """Under gravity, a robot holds its commanded home position for 1 s, and a wheeled robot does not move."""
    with _standing(subject) as (sim, robot):
        robot.command(robot.home.copy())
        start = robot.base_pose[0].copy()
        sim.step(round(1.0 / TIMESTEP))
        if subject.robot.base == "wheeled":
            expect_close(start, robot.base_pose[0], 0.02, "the base's position after 1 s [m]")
            return
        names = ", ".join(robot.joint_names)
        expect_close(
            robot.home, robot.joint_positions, _SAG, f"joint positions ({names}) after 1 s, compared with home"
        )
        velocities = _velocities(sim, robot)
        expect_close(np.zeros_like(robot.home), velocities, 0.05, f"joint velocities ({names}) after 1 s")


@contextmanager
def _standing(subject: RobotUnderTest) -> Iterator[tuple[Simulation, RobotHandle]]:
    """Build a robot that can stay at home. A fixed base needs no floor; home_is_above_floor compares it with the floor."""
    if subject.robot.base == "floating":
        raise NotApplicable("a floating base falls")
    if subject.robot.base == "fixed":
        efforts_hold_home(subject)
    with subject.build(Scene(floor=subject.robot.base != "fixed")) as built:
        yield built


def _velocities(sim: Simulation, robot: RobotHandle) -> Floats:
    """Return the joint velocities (1, dof) [rad/s or m/s], averaged if gravity pulls a joint against its limit.

    Such a joint rebounds from its limit by less than a milliradian, but with considerable velocities.
    """
    home = robot.home
    at_limit = np.minimum(np.abs(home - robot.position_lower), np.abs(robot.position_upper - home)) < _STOP
    read = []
    for _ in range(round(_REBOUND / TIMESTEP) if at_limit.any() else 1):
        read.append(robot.joint_velocities.copy())
        sim.step(1)
    return np.asarray(np.mean(read, axis=0))


def joints_follow(subject: RobotUnderTest) -> None:
    """Each joint reaches a commanded position near home, and wheels turn in the commanded direction."""
    wheels = _wheels(subject)
    with _standing(subject) as (sim, robot):
        rolls = np.array([name in wheels for name in robot.joint_names], bool)
        if rolls.any():
            robot.set_command_mode([CommandMode.VELOCITY if rolling else CommandMode.POSITION for rolling in rolls])
        for joint, name in enumerate(robot.joint_names):
            sim.reset()
            home = robot.home[0, joint]
            up, down = min(0.1, robot.position_upper[0, joint] - home), max(-0.1, robot.position_lower[0, joint] - home)
            step = up if up >= -down else down
            command = np.where(rolls, 0.0, robot.home)
            command[0, joint] += 1.0 if rolls[joint] else step
            before = robot.joint_positions.copy()
            robot.command(command)
            sim.step(round(1.0 / TIMESTEP))
            moved = robot.joint_positions - before
            if rolls[joint]:
                expect(
                    moved[0, joint] > 0.1,
                    f"joint '{name}' turns by {moved[0, joint]:.3g} rad in 1 s, although a velocity of 1 rad/s is "
                    "commanded.",
                )
                continue
            what = f"position of joint '{name}' 1 s after a command to move {step:+.2g} from home"
            expect_close(command[0, joint], robot.joint_positions[0, joint], min(_SAG, 0.5 * abs(step)), what)


def _wheels(subject: RobotUnderTest) -> set[str]:
    """Return the joints of a wheeled robot that are driven by velocity. Other joints, such as fingers, are not."""
    robot, drive = subject.robot, subject.robot.differential_drive
    if robot.base != "wheeled":
        return set()
    driven = set() if drive is None else {*drive.left, *drive.right}
    return driven | {name for name in subject.model.joint_names if subject.gains.of(name)[0] == 0.0}


def wheels_drive_as_described(subject: RobotUnderTest) -> None:
    """A differential drive moves as its wheel velocities, wheel separation and wheel radius predict."""
    drive = subject.robot.differential_drive
    if drive is None:
        raise NotApplicable("the robot has no differential drive")
    advice = "check left, right, separation and wheel_radius of differential_drive"
    with subject.build() as (sim, robot):
        robot.set_command_mode(CommandMode.VELOCITY)
        left, right = ([robot.joint_names.index(name) for name in side] for side in (drive.left, drive.right))
        fastest = float(robot.velocity_limit[0, [*left, *right]].min())  # [rad/s]
        forward = min(0.5 * drive.max_linear_velocity, 0.5 * fastest * drive.wheel_radius)  # [m/s]
        turning = min(0.5 * drive.max_angular_velocity, fastest * drive.wheel_radius / drive.separation)  # [rad/s]
        for linear, angular in ((forward, 0.0), (0.0, turning)):
            sim.reset()
            command = np.zeros_like(robot.home)
            command[:, left] = (linear - 0.5 * angular * drive.separation) / drive.wheel_radius
            command[:, right] = (linear + 0.5 * angular * drive.separation) / drive.wheel_radius
            robot.command(command)
            sim.step(round(0.5 / TIMESTEP))  # let the robot accelerate
            pos, ahead = _pos_and_ahead(robot)
            sim.step(round(1.0 / TIMESTEP))
            pos_after, ahead_after = _pos_and_ahead(robot)
            if linear:
                what = f"distance driven straight ahead in 1 s [m]; {advice}"
                expect_close(linear, float((pos_after - pos) @ ahead), _SLIP * linear, what)
            else:
                turned = np.arctan2(np.cross(ahead, ahead_after)[2], ahead @ ahead_after)
                expect_close(
                    angular, turned, _SLIP_TURNING * angular, f"angle turned to the left in 1 s [rad]; {advice}"
                )


def _pos_and_ahead(robot: RobotHandle) -> tuple[Floats, Floats]:
    """Return the base's position [m] and x axis in the world frame, each of shape (3,)."""
    pos, quat = robot.base_pose
    return pos[0].copy(), quat_rotate(quat, np.array([[1.0, 0.0, 0.0]]))[0]


def home_is_free(subject: RobotUnderTest) -> None:
    """In the home position, links that are not neighbors do not touch."""
    if not subject.robot.self_collision:
        raise NotApplicable("the robot's description disables self-collision")
    with subject.build() as (sim, _robot):
        overlaps = sim.overlaps()
    if overlaps is not None:
        texts = [f"{overlap.first} and {overlap.second}" for overlap in overlaps]
        expect(not texts, f"in the home position, these links overlap: {'; '.join(texts)}.")
        return
    assert subject.simulator is not None
    if subject.simulator.capabilities.get("contacts", Level.UNSUPPORTED) == Level.UNSUPPORTED:
        raise Inconclusive(f"simulator '{subject.simulator.name}' supports neither overlaps nor contacts")
    model = subject.model
    solid = [link.name for link in model.links if link.collisions]
    beside = {frozenset((joint.parent, joint.child)) for joint in model.joints}
    pairs = [pair for pair in combinations(solid, 2) if frozenset(pair) not in beside]
    if not pairs:
        raise NotApplicable("all pairs of links with collision shapes are neighbors")
    contacts = {f"{a} and {b}": Contact(first=f"robot/{a}", second=f"robot/{b}") for a, b in pairs}
    with subject.build(Scene(contacts=contacts)) as (sim, robot):
        robot.command(robot.home.copy())
        sim.step(1)
        touching = [name for name in contacts if sim.contact(name)[0]]
        expect(not touching, f"in the home position, these links touch: {'; '.join(touching)}.")
