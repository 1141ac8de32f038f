"""Checks of force-torque sensors, and of wrenches that are applied together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.description import ForceTorque
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import CapabilityError, UnknownNameError
from frobs_core.util.rotations import quat_conjugate, quat_rotate
from frobs_devkit.testing.checks import after, expect, expect_raises
from frobs_devkit.testing.compare import expect_array, expect_close
from frobs_devkit.testing.simulator.robots import ARM
from frobs_devkit.testing.simulator.under_test import BALL, TILTED, TIMESTEP, WEIGHTLESS, SimulatorUnderTest, verifies

_BEYOND = {"elbow": ("fore", "tool"), "wrist": ("tool",)}  # links that each sensor carries
_SENSING = replace(ARM, sensors={"elbow": ForceTorque(frame="fore"), "wrist": ForceTorque(frame="tool")})
_GRAVITY = 9.81  # [m/s²]


@verifies("force_torque")
@after("frames_are_current")
def weights_are_measured(subject: SimulatorUnderTest) -> None:
    """At rest, a force-torque sensor measures the weight of the links that it carries, in the sensor's frame."""
    with subject.build(_SENSING, pose=TILTED) as (sim, robot):
        turned = np.array([[0.4, -0.7]]) * np.arange(sim.num_envs)[:, None]
        robot.command(robot.home + turned)
        sim.step(2000)  # long enough for the robot to come to rest
        sim.step(5)
        for sensor, frame in (("elbow", "fore"), ("wrist", "tool")):
            read = sim.sensor_wrench("robot", sensor)
            expect_array(read, (sim.num_envs, 6), np.float64, f"sensor_wrench('robot', '{sensor}')")
            _expect_wrench(subject, _weight(robot, sensor, frame), read, f"force-torque sensor '{sensor}' at rest")
        with expect_raises(UnknownNameError, "sensor_wrench('robot', 'no_such_sensor')"):
            sim.sensor_wrench("robot", "no_such_sensor")


@verifies("force_torque")
@after("frames_are_current", "frame_velocity_is_current")
def inertia_is_measured(subject: SimulatorUnderTest) -> None:
    """In motion, a force-torque sensor measures the force that supports and accelerates the links that it carries."""
    with subject.build(_SENSING, pose=TILTED) as (sim, robot):
        robot.command(robot.home + np.array([[1.0, 0.4]]) * (1.0 + np.arange(sim.num_envs)[:, None]) / sim.num_envs)
        sim.step(10)
        weight = _weight(robot, "elbow", "fore")[:, :3]
        before, turn = _momentum(robot, "elbow"), quat_conjugate(robot.frame_pose("fore")[1])
        sim.step(1)
        force = weight + quat_rotate(turn, (_momentum(robot, "elbow") - before) / TIMESTEP)
        read = sim.sensor_wrench("robot", "elbow")[:, :3]
        expect_close(force, read, 0.1 * np.abs(force).max(), "force measured by a force-torque sensor in motion [N]")


@verifies("force_torque", "wrench")
@after("contacts_are_those_of_all_steps")
def pushes_are_measured(subject: SimulatorUnderTest) -> None:
    """A force-torque sensor measures pushes on its links over all physics steps, and a reset clears the reading."""
    with subject.build(_SENSING, pose=TILTED, gravity=WEIGHTLESS) as (sim, robot):
        n = sim.num_envs
        force = np.array([[6.0, -3.0, 2.0]]) * (1.0 + np.arange(n))[:, None]
        for _ in range(2):
            sim.apply_wrench("robot/tool", force, np.zeros((n, 3)))
            sim.step(1000)
        held = _in_frame(robot, "tool", np.concatenate([-force, np.zeros((n, 3))], axis=1))
        what = "wrench measured by the force-torque sensor of a pushed link"
        _expect_wrench(subject, held, sim.sensor_wrench("robot", "wrist"), what)
        sim.apply_wrench("robot/tool", force, np.zeros((n, 3)))
        sim.step_with(4, lambda: None)
        what = "wrench measured by a force-torque sensor after step_with"
        _expect_wrench(subject, held, sim.sensor_wrench("robot", "wrist"), what)
        if subject.level("snapshot"):
            snapshot = sim.snapshot()
            sim.step(100)
            sim.restore(snapshot)
            read = sim.sensor_wrench("robot", "wrist")
            _expect_wrench(subject, held, read, "force-torque sensor after a restore")
        mask = np.arange(n) == 0
        sim.reset(mask)
        read = sim.sensor_wrench("robot", "wrist")
        expect(
            not read[0].any(), "after a reset, a force-torque sensor still reads the force from the previous episode."
        )
        expect_close(
            held[1:], read[1:], 0.01 * np.abs(held).max(), "force-torque sensors in environments that were not reset"
        )


@verifies("wrench")
@after("wrenches_push")
def wrenches_add(subject: SimulatorUnderTest) -> None:
    """Wrenches on one body add up until the next step, a snapshot includes them, and a reset removes them."""
    tolerance = subject.tolerance("wrench", exact=1e-6)
    forces, torques = np.array([[1.0, -0.5, 0.3], [0.2, 0.8, -0.1]]), np.array([[1e-3, 0.0, 0.0], [0.0, 2e-3, -1e-3]])
    with subject.build(bodies={"ball": BALL}, gravity=WEIGHTLESS, floor=False) as (sim, _):
        n, t, ball = sim.num_envs, 10 * TIMESTEP, sim.bodies["ball"]

        def expect_total(rows: Floats, when: str) -> None:
            moment = 0.4 * 0.5 * 0.05**2
            for part, share, what in ((forces, 0.5, "velocity [m/s]"), (torques, moment, "ang_vel_world [rad/s]")):
                actual = ball.twist[0] if what[0] == "v" else ball.twist[1]
                expect_close(rows * part.sum(axis=0) * t / share, actual, tolerance, f"{what} of a ball {when}")

        def push() -> None:
            for force, torque in zip(forces, torques, strict=True):
                sim.apply_wrench("ball", force[None].repeat(n, axis=0), torque[None].repeat(n, axis=0))

        push()
        snapshot = sim.snapshot() if subject.level("snapshot") else None
        sim.step(10)
        expect_total(np.ones((n, 1)), "after two calls of apply_wrench")
        if snapshot is not None:
            sim.reset()
            push()
            sim.restore(snapshot)
            sim.step(10)
            expect_total(np.ones((n, 1)), "after restoring a snapshot that was taken between apply_wrench and step")
        sim.reset()
        push()
        sim.reset(np.arange(n) == 0)
        sim.step_with(10, lambda: None)
        expect_total((np.arange(n)[:, None] > 0).astype(float), "after a reset between apply_wrench and step_with")


def undeclared_readings_refused(subject: SimulatorUnderTest) -> None:
    """Reading contacts or force-torque sensors raises CapabilityError if the record does not declare the capability."""
    with subject.build(_SENSING) as (sim, _):
        if not subject.level("force_torque"):
            with expect_raises(CapabilityError, "sensor_wrench of a simulator without 'force_torque'"):
                sim.sensor_wrench("robot", "wrist")
        if not subject.level("contacts"):
            with expect_raises(CapabilityError, "contact of a simulator without 'contacts'"):
                sim.contact("any")


def _weight(robot: RobotHandle, sensor: str, frame: str) -> Floats:
    """Return the wrench that supports a sensor's links at rest, in the sensor's frame, (num_envs, 6)."""
    links = {link.name: link for link in robot.model.links}
    origin, wrench = robot.frame_pose(frame)[0], np.zeros((robot.num_envs, 6))
    for name in _BEYOND[sensor]:
        inertial = links[name].inertial
        assert inertial is not None
        pos, quat = robot.frame_pose(name)
        center = pos + quat_rotate(quat, np.broadcast_to(np.array(inertial.origin.pos), pos.shape))
        lift = np.broadcast_to(np.array([0.0, 0.0, _GRAVITY * inertial.mass]), pos.shape)
        wrench += np.concatenate([lift, np.cross(center - origin, lift)], axis=1)
    return _in_frame(robot, frame, wrench)


def _momentum(robot: RobotHandle, sensor: str) -> Floats:
    """Return the linear momentum of a sensor's links in the world frame, (num_envs, 3) [kg·m/s]."""
    total = np.zeros((robot.num_envs, 3))
    for link in robot.model.links:
        if link.name in _BEYOND[sensor] and link.inertial is not None:
            linear, angular = robot.frame_velocity(link.name)
            lever = quat_rotate(robot.frame_pose(link.name)[1], np.tile(link.inertial.origin.pos, (robot.num_envs, 1)))
            total += link.inertial.mass * (linear + np.cross(angular, lever))
    return total


def _in_frame(robot: RobotHandle, frame: str, wrench: Floats) -> Floats:
    """Rotate a wrench, (num_envs, 6), from the world's axes to a link's axes."""
    back = quat_conjugate(robot.frame_pose(frame)[1])
    return np.concatenate([quat_rotate(back, wrench[:, :3]), quat_rotate(back, wrench[:, 3:])], axis=1)


def _expect_wrench(subject: SimulatorUnderTest, expected: Floats, read: Floats, what: str) -> None:
    share = subject.tolerance("force_torque", exact=0.01, approximate=0.1)
    for part, unit in ((slice(0, 3), "force [N]"), (slice(3, 6), "torque [N·m]")):
        tolerance = share * max(np.abs(expected[:, part]).max(), 0.01)
        expect_close(expected[:, part], read[:, part], tolerance, f"{what}: the {unit}")
