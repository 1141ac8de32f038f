"""Checks that physical parameters affect the motion in their own environment and persist across resets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from frobs_core.contracts import CommandMode, Simulation
from frobs_core.description import Body, Shape
from frobs_core.models import Box, Pose, Sphere
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_devkit.testing.checks import after, expect, expect_raises
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.simulator.robots import GRIPPER, LIFT, LIFT_INERTIA
from frobs_devkit.testing.simulator.under_test import BALL, TIMESTEP, WEIGHTLESS, SimulatorUnderTest, verifies

assert isinstance(BALL.geometry, Sphere)
_RADIUS = BALL.geometry.radius
_BOX = Body(geometry=Box((0.2, 0.2, 0.2)), pose=Pose(pos=(0.0, 2.0, 0.1)), mass=1.0)


@verifies("randomize_gravity")
def gravity_shows(subject: SimulatorUnderTest) -> None:
    """In each environment, a ball falls with the gravity that is set for that environment."""
    with subject.build(bodies={"ball": BALL}, floor=False) as (sim, _):
        n = sim.num_envs
        subject.expect_each([0.0, 0.0, -9.81], sim.parameter("gravity"), 1e-12, "gravity of the scene")
        values = np.stack([np.zeros(n), 0.5 * np.arange(n), -1.0 - np.arange(n)], axis=-1)
        _write(sim, "gravity", "", values)
        sim.step(50)
        tolerance = subject.tolerance("randomize_gravity", exact=1e-6)
        expect_close(values * 50 * TIMESTEP, sim.bodies["ball"].twist[0], tolerance, "lin_vel_world of a falling ball")


@verifies("randomize_mass")
@after("wrenches_push")
def mass_shows(subject: SimulatorUnderTest) -> None:
    """The mass that is set in an environment determines how a body reacts to forces, and scales the body's inertia."""
    if not subject.level("wrench"):
        _only_written(subject, "mass", "ball", np.array([0.5]), np.array([0.8]))
        return
    with subject.build(bodies={"ball": BALL}, gravity=WEIGHTLESS, floor=False) as (sim, _):
        n = sim.num_envs
        subject.expect_each(0.5, sim.parameter("mass", "ball"), 1e-12, "mass of the scene's body [kg]")
        values = 0.8 + 0.3 * np.arange(n, dtype=np.float64)
        _write(sim, "mass", "ball", values)
        force, torque = np.array([[2.0, 0.0, 0.0]]).repeat(n, axis=0), np.array([[0.0, 0.0, 1e-3]]).repeat(n, axis=0)
        sim.apply_wrench("ball", force, torque)
        sim.step(10)
        tolerance = subject.tolerance("randomize_mass", exact=1e-6)
        lin_vel, ang_vel = sim.bodies["ball"].twist
        expected = 2.0 * 10 * TIMESTEP / values
        expect_close(expected, lin_vel[:, 0], tolerance, "velocity of a pushed ball [m/s]")
        turned = 1e-3 * 10 * TIMESTEP / (0.4 * values * _RADIUS**2)  # a solid ball
        expect_close(turned, ang_vel[:, 2], tolerance, "angular velocity of a ball after applying a torque [rad/s]")


@verifies("randomize_gains")
def gains_show(subject: SimulatorUnderTest) -> None:
    """In each environment, the drives use the stiffness and damping that are set for that environment."""
    with subject.build(LIFT, gravity=WEIGHTLESS) as (sim, robot):
        n = sim.num_envs
        kp = np.array([1500.0, 3.0]) * (1.0 + 0.3 * np.arange(n)[:, None])  # (num_envs, dof)
        kd = np.array([100.0, 0.2]) * (1.0 + 0.5 * np.arange(n)[:, None])
        _write(sim, "stiffness", "robot", kp)
        _write(sim, "damping", "robot", kd)
        for name, gain, actual in zip(("Kp", "Kd"), (kp, kd), robot.drive_gains(), strict=True):
            expect_close(gain, actual, 1e-9, f"drive_gains() after write_parameter: {name}")
        q, v = robot.joint_positions.copy(), np.zeros((n, 2))
        robot.command(np.full((n, 2), 0.05))
        for _ in range(40):
            v = v + TIMESTEP * (kp * (0.05 - q) - kd * v) / (np.array(LIFT_INERTIA) + TIMESTEP * kd)
            q = q + TIMESTEP * v
        sim.step(40)
        tolerance = subject.tolerance("randomize_gains", approximate=0.01)
        expect_close(q, robot.joint_positions, tolerance, "joint positions with the written gains")


@verifies("randomize_joint_damping")
def joint_damping_shows(subject: SimulatorUnderTest) -> None:
    """The joint damping that is set in an environment slows down a freely moving joint in that environment."""
    with subject.build(LIFT, mode=CommandMode.EFFORT, gravity=WEIGHTLESS) as (sim, robot):
        n = sim.num_envs
        damping = np.stack([np.zeros(n), 0.05 + 0.05 * np.arange(n)], axis=-1)
        _write(sim, "joint_damping", "robot", damping)
        if subject.level("teleport"):
            robot.write_joint_state(np.zeros((n, 2)), np.array([[0.1, 1.0]]).repeat(n, axis=0))
            sim.step(100)
            expected = np.array([0.1, 1.0]) * np.exp(-damping * 100 * TIMESTEP / np.array(LIFT_INERTIA))
            expect_close(expected, robot.joint_velocities, 0.02, "joint velocities, slowed by joint_damping")


@verifies("randomize_friction")
def friction_shows(subject: SimulatorUnderTest) -> None:
    """The friction that is set in an environment determines how a pushed box slides across the floor."""
    if not subject.level("wrench"):
        _only_written(subject, "friction", "box", np.array([1.0]), np.array([0.3]))
        return
    slid: dict[float, list[float]] = {0.05: [], 1.0: []}
    for turn in (0, 1):
        with subject.build(bodies={"box": _BOX}) as (sim, _):
            n = sim.num_envs
            slippery = np.arange(n) % 2 == turn
            values = np.where(slippery, 0.05, 1.0)
            _write(sim, "friction", "floor", values)
            _write(sim, "friction", "box", values)
            sim.step(100)
            start = sim.bodies["box"].pose[0][:, 0].copy()
            for _ in range(20):
                sim.apply_wrench("box", np.array([[4.0, 0.0, 0.0]]).repeat(n, axis=0), np.zeros((n, 3)))
                sim.step(10)
            for value, distance in zip(values, sim.bodies["box"].pose[0][:, 0] - start, strict=True):
                slid[float(value)].append(float(distance))
    expect(
        min(slid[0.05]) > 0.1 and max(slid[1.0]) < 0.02,
        f"a force of 4 N for 0.4 s moves a box of 1 kg by {slid[0.05]} m with friction 0.05, and by {slid[1.0]} m "
        "with friction 1; expected about 0.28 m and 0 m.",
    )


@verifies("randomize_size")
@after("wrenches_push", "gravity_shows")
def sizes_show(subject: SimulatorUnderTest) -> None:
    """In each environment, a body has the size that is set for that environment, and keeps its mass."""
    pillar = Body(
        shapes=(
            Shape(Box((0.1, 0.1, 0.2)), Pose((0.0, 0.0, 0.1))),
            Shape(Box((0.1, 0.1, 0.1)), Pose((0.0, 0.0, 0.25))),
        ),
        pose=Pose((0.0, 0.0, 0.5)),
        mass=1.0,
    )
    with subject.build(bodies={"pillar": pillar}, gravity=WEIGHTLESS) as (sim, _):
        n = sim.num_envs
        subject.expect_each(1.0, sim.parameter("size", "pillar"), 1e-12, "initial size")
        values = 0.5 + 0.5 * np.arange(n, dtype=np.float64)
        _write(sim, "size", "pillar", np.full(n, 3.0))
        _write(sim, "size", "pillar", values)
        subject.expect_each(1.0, sim.parameter("mass", "pillar"), 1e-12, "mass after the size was written [kg]")
        sim.write_parameter("gravity", "", np.array([[0.0, 0.0, -9.81]]).repeat(n, axis=0))
        sim.bodies["pillar"].write_pose(np.array([[0.0, 0.0, 0.01]]).repeat(n, axis=0))
        sim.step(500)
        subject.expect_each(0.0, sim.bodies["pillar"].pose[0][:, 2], 2e-3, "height of the lower end of a pillar [m]")
        upside_down = np.array([[0.0, 1.0, 0.0, 0.0]]).repeat(n, axis=0)
        heights = np.stack([np.zeros(n), np.zeros(n), 0.3 * values + 0.01], axis=-1)
        sim.bodies["pillar"].write_pose(heights, upside_down)
        sim.step(500)
        expect_close(0.3 * values, sim.bodies["pillar"].pose[0][:, 2], 2e-3, "height of a pillar upside down [m]")
    if not subject.level("wrench"):
        return
    with subject.build(bodies={"ball": BALL}, gravity=WEIGHTLESS, floor=False) as (sim, _):
        _write(sim, "size", "ball", values)
        sim.apply_wrench("ball", np.zeros((n, 3)), np.array([[0.0, 0.0, 1e-3]]).repeat(n, axis=0))
        sim.step(10)
        turned = 1e-3 * 10 * TIMESTEP / (0.4 * 0.5 * (_RADIUS * values) ** 2)  # a solid ball of 0.5 kg
        tolerance = subject.tolerance("randomize_size", exact=1e-6)
        what = "angular velocity of a ball after applying a torque [rad/s]"
        expect_close(turned, sim.bodies["ball"].twist[1][:, 2], tolerance, what)


@verifies("randomize_mass")
def parameters_stay(subject: SimulatorUnderTest) -> None:
    """Parameters affect only environments selected by the mask and survive resets. Unknown names raise errors."""
    with subject.build(bodies={"ball": BALL}) as (sim, _):
        n = sim.num_envs
        sim.write_parameter("mass", "ball", np.array([0.9]), np.arange(n) == 0)
        expected = np.where(np.arange(n) == 0, 0.9, 0.5)
        expect_close(expected, sim.parameter("mass", "ball"), 1e-12, "masses after writing to environment 0 [kg]")
        sim.reset()
        expect_close(expected, sim.parameter("mass", "ball"), 1e-12, "masses after a reset [kg]")
        for name, target in (("no_such_parameter", ""), ("mass", "no_such_body")):
            with expect_raises(UnknownNameError, f"parameter('{name}', '{target}')"):
                sim.parameter(name, target)


@verifies("randomize_mass")
def inertia_follows_mass(subject: SimulatorUnderTest) -> None:
    """The motion depends only on the mass that was written last, not on earlier masses."""
    ends = []
    for masses in ((1.9,), (1.1, 0.2, 3.3, 1.9)):
        with subject.build() as (sim, robot):
            n = sim.num_envs
            for mass in masses:
                sim.write_parameter("mass", "robot/fore", np.full(n, mass))
            robot.command(robot.home + 0.4)
            sim.step(40)
            ends.append(robot.joint_positions.copy())
    tolerance = subject.tolerance("randomize_mass", exact=1e-12)
    what = "joint positions with a mass that was written once, compared with a mass that was written after other masses"
    expect_close(ends[0], ends[1], tolerance, what)


@verifies("randomize_gains")
def drives_hold_as_gains_change(subject: SimulatorUnderTest) -> None:
    """Drives keep their targets when their gains change, and hold the home position with new gains after resets."""
    with subject.build(gravity=WEIGHTLESS, floor=False) as (sim, robot):
        n = sim.num_envs
        target = robot.home + 0.2
        robot.command(target)
        for name, factor in (("stiffness", 0.5), ("damping", 2.0)):
            values = sim.parameter(name, "robot")[:1] * factor
            sim.write_parameter(name, "robot", values, np.arange(n) == 0)
        sim.step(1500)
        expect_close(target, robot.joint_positions, 1e-2, "joint positions after the drive gains changed [rad]")
        if not subject.level("teleport"):
            return
        for restore in (False, True):
            if restore and subject.level("snapshot"):
                sim.restore(sim.snapshot())
            sim.reset()
            sim.step(50)
            expect_close(
                robot.home, robot.joint_positions, 1e-6, "joint positions after a reset with the new gains [rad]"
            )


@verifies("randomize_mass")
def frames_without_mass_refused(subject: SimulatorUnderTest) -> None:
    """Setting the mass of a massless link raises a ConfigurationError."""
    what = "write_parameter('mass', …) of a link without mass"
    with subject.build(GRIPPER) as (sim, _), expect_raises(ConfigurationError, what):
        sim.write_parameter("mass", "robot/tip", np.ones(sim.num_envs))


def _write(sim: Simulation, name: str, target: str, values: Floats) -> None:
    sim.write_parameter(name, target, values)
    expect_close(values, sim.parameter(name, target), 1e-9, f"the written parameter('{name}', '{target}')")


def _only_written(subject: SimulatorUnderTest, name: str, target: str, before: Floats, after: Floats) -> None:
    """Check only that the value is stored, for simulators that cannot apply wrenches."""
    with subject.build(bodies={target: replace(BALL, mass=0.5)}) as (sim, _):
        expect_close(before.repeat(sim.num_envs), sim.parameter(name, target), 1e-12, f"{name} in the scene")
        _write(sim, name, target, after.repeat(sim.num_envs))
