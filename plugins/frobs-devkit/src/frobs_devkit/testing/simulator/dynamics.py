"""Checks of passive motion against closed-form solutions: free bodies, and joints without or with constant commands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.description import Body
from frobs_core.models import Box, Inertial, Treatment, gravity_efforts, inertia_matrix
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import (
    matrix_from_quat,
    quat_conjugate,
    quat_from_axis_angle,
    quat_multiply,
    quat_rotate,
)
from frobs_devkit.testing.checks import NotApplicable, after, expect
from frobs_devkit.testing.compare import expect_close, expect_same_pose
from frobs_devkit.testing.simulator.robots import LIFT, LIFT_INERTIA, model_of
from frobs_devkit.testing.simulator.under_test import BALL, TILTED, TIMESTEP, WEIGHTLESS, SimulatorUnderTest, verifies

_GRAVITY = (1.0, -2.0, -5.0)  # [m/s²] differs in direction and size from the usual gravity
_TWIST = (0.3, -0.2, 0.1), (1.0, 2.0, -3.0)
_HALF = 0.5 * TIMESTEP  # [s] another physics timestep than that of the other checks
_PLATE = Body(geometry=Box((0.3, 0.12, 0.04)), pose=TILTED, twist=((0.0, 0.0, 0.0), (1.0, 4.0, 3.0)), mass=1.0)
_FAST = np.array([[0.3, 2.0]])  # [m/s, rad/s]
_TOLERANCES = {Treatment.KEPT: 0.1, Treatment.APPROXIMATED: 0.25}  # tolerated error, as a fraction of the loss
_RESISTANCES: dict[str, tuple[str, tuple[float, float], Callable[[Floats, Floats], Floats]]] = {
    # element of the model: field of a joint, values of both joints, acceleration at (values, velocities)
    "joint_damping": ("damping", (5.0, 0.06), lambda value, v: -value * v / np.array(LIFT_INERTIA)),
    "joint_friction": ("friction", (1.0, 0.05), lambda value, v: -value * np.sign(v) / np.array(LIFT_INERTIA)),
}


@verifies("teleport")
def bodies_fall_and_spin(subject: SimulatorUnderTest) -> None:
    """In any gravity, a thrown ball follows a parabola and turns about its angular velocity in the world frame."""
    steps, twist = 200, np.array(_TWIST)
    t, turn = steps * _HALF, np.array(_TWIST[1])
    scene = {"ball": replace(BALL, pose=TILTED, twist=_TWIST)}
    with subject.build(bodies=scene, gravity=_GRAVITY, floor=False, timestep=_HALF, num_threads=1) as (sim, _):
        n, ball = sim.num_envs, sim.bodies["ball"]
        sim.step(steps)
        subject.expect_each(t, sim.time, 1e-9, f"time after {steps} steps of {_HALF} s [s]")
        tolerance = subject.tolerance("teleport", exact=1e-6)
        subject.expect_each(twist[0] + t * np.array(_GRAVITY), ball.twist[0], tolerance, "lin_vel_world")
        subject.expect_each(twist[1], ball.twist[1], tolerance, "ang_vel_world of a ball in the air")
        speed = float(np.linalg.norm(turn))
        turned = quat_multiply(quat_from_axis_angle(turn / speed, np.array(speed * t)), np.array(TILTED.quat_wxyz))
        fallen = np.array(TILTED.pos) + t * twist[0] + 0.5 * t * (t + _HALF) * np.array(_GRAVITY)
        what = f"pose of a ball that falls and spins about {turn.tolist()} for {t:.1f} s"
        expect_same_pose((np.tile(fallen, (n, 1)), np.tile(turned, (n, 1))), ball.pose, 2e-3, what)


@verifies("wrench")
@after("bodies_fall_and_spin")
def plates_precess(subject: SimulatorUnderTest) -> None:
    """A body with three different moments of inertia keeps its angular momentum, so that its spin axis moves."""
    inertial = _PLATE.inertial
    assert inertial is not None
    steps = 100
    quat, spin = _free_spin(inertial, np.array(TILTED.quat_wxyz), np.array(_PLATE.twist[1]), steps * TIMESTEP)
    with subject.build(bodies={"plate": _PLATE}, gravity=WEIGHTLESS, floor=False, num_threads=1) as (sim, _):
        n, plate = sim.num_envs, sim.bodies["plate"]
        sim.step(steps)
        subject.expect_each(spin, plate.twist[1], 0.1, "ang_vel_world of a plate that spins freely")
        expected = np.tile(TILTED.pos, (n, 1)), np.tile(quat, (n, 1))
        expect_same_pose(expected, plate.pose, 0.02, "pose of a plate that spins freely")


@verifies("drive", "teleport")
def joints_coast(subject: SimulatorUnderTest) -> None:
    """Without an effort, a joint's damping and dry friction slow it down as specified in the model file."""
    model, steps = model_of(LIFT.model), 50
    for element, (name, values, acceleration) in _RESISTANCES.items():
        own = dict(zip(model.joint_names, values, strict=True))
        changed = replace(model, joints=tuple(replace(joint, **{name: own[joint.name]}) for joint in model.joints))  # type: ignore[arg-type]
        treatments = {row.element: row.treatment for row in subject.record.load().translation(changed)}
        tolerance = _TOLERANCES.get(treatments.get(element, Treatment.DROPPED))
        if tolerance is None:
            continue  # the simulator declares that it ignores this element
        options: dict[str, Any] = {
            "mode": CommandMode.EFFORT,
            "gravity": WEIGHTLESS,
            "floor": False,
            "model": changed,
            "num_threads": 1,
        }
        with subject.build(LIFT, **options) as (sim, robot):
            n = sim.num_envs
            robot.write_joint_state(np.zeros((n, 2)), _FAST.repeat(n, axis=0))
            sim.step(steps)
            v = _FAST.copy()
            for _ in range(100 * steps):
                v = v + 0.01 * TIMESTEP * acceleration(np.array(values), v)
            lost = (_FAST - v).repeat(n, axis=0)
            expect_close(
                lost / _FAST,
                1.0 - robot.joint_velocities / _FAST,
                tolerance * float((lost / _FAST).max()),
                f"fraction of its velocity that a joint with a {name} of {list(values)} loses in {steps * TIMESTEP} s",
            )


@verifies("drive")
@after("drives_apply_efforts")
def armatures_resist(subject: SimulatorUnderTest) -> None:
    """The inertia of a rotating motor, from the robot's description, adds to the inertia of its joint.

    This is part of the drive law, so it applies to simulators that follow the law exactly.
    """
    if subject.level("drive") < Level.EXACT:
        raise NotApplicable("the simulator follows the drive law only approximately")
    steps, effort, inertia = 50, 0.2, LIFT_INERTIA[1]
    motor = replace(LIFT, armature={"turn": inertia})
    with subject.build(motor, mode=CommandMode.EFFORT, gravity=WEIGHTLESS, floor=False, num_threads=1) as (sim, robot):
        robot.command(np.tile([0.0, effort], (sim.num_envs, 1)))
        sim.step(steps)
        expected = np.full(sim.num_envs, effort * steps * TIMESTEP / (2.0 * inertia))
        what = f"velocity of a joint whose motor doubles its inertia, after an effort of {effort} N·m [rad/s]"
        expect_close(expected, robot.joint_velocities[:, 1], subject.tolerance("drive", exact=1e-6), what)


@verifies("drive")
@after("frames_are_current")
def joints_carry_their_weight(subject: SimulatorUnderTest) -> None:
    """In any gravity and any pose of the base, the drives' efforts at rest support the weight of the links."""
    if subject.record.is_paced:
        raise NotApplicable("the simulator is paced, so its world has its own gravity")
    with subject.build(pose=TILTED, gravity=_GRAVITY, floor=False, num_threads=1) as (sim, robot):
        robot.command(robot.home + np.array([[0.4, -0.7]]) * np.arange(sim.num_envs)[:, None])
        for _ in range(100):  # long enough for the robot to come to rest
            sim.step(20)
        gravity = quat_rotate(quat_conjugate(np.array(TILTED.quat_wxyz)), np.array(_GRAVITY))
        weight = np.array([gravity_efforts(robot.model, positions, gravity) for positions in robot.joint_positions])
        tolerance = subject.tolerance("drive", exact=0.01, approximate=0.1) * float(np.abs(weight).max())
        expect_close(weight, robot.joint_efforts, tolerance, "joint_efforts of an arm at rest, against its weight")


@verifies("drive")
def limits_stop_joints(subject: SimulatorUnderTest) -> None:
    """A joint does not move beyond its position limits, even if a target is beyond them."""
    with subject.build(gravity=WEIGHTLESS, floor=False, num_threads=1) as (sim, robot):
        for limits, side in ((robot.position_upper, 1.0), (robot.position_lower, -1.0)):
            robot.command(limits - 0.2 * side)
            sim.step(600)
            robot.command(limits + 0.1 * side)
            sim.step(200)
            beyond = float((side * (robot.joint_positions - limits)).max())
            expect(beyond < 0.05, f"a joint is {beyond:.3g} rad beyond its position limit.")


@verifies("drive")
def command_modes_mix(subject: SimulatorUnderTest) -> None:
    """If joints have different command modes, one joint follows a velocity while the other one holds a position."""
    modes = (CommandMode.VELOCITY, CommandMode.POSITION)
    with subject.build(LIFT, gravity=WEIGHTLESS, num_threads=1) as (sim, robot):
        robot.set_command_mode(modes)
        expect(tuple(robot.command_modes) == modes, f"command_modes is {robot.command_modes}, not {modes}.")
        command = np.array([[0.2, 0.5]]).repeat(sim.num_envs, axis=0)
        robot.command(command)
        sim.step(1000)
        expect_close(command[:, 0], robot.joint_velocities[:, 0], 0.01, "velocity of a joint with a velocity command")
        expect_close(command[:, 1], robot.joint_positions[:, 1], 0.01, "position of a joint with a position command")


def _free_spin(inertial: Inertial, quat: Floats, spin: Floats, seconds: float) -> tuple[Floats, Floats]:
    """Return the orientation (4,) and angular velocity (3,) of a body that nothing touches, in the world frame."""
    inertia, steps = inertia_matrix(inertial), 2_000
    turn = matrix_from_quat(quat)
    momentum = turn @ inertia @ turn.T @ spin
    for _ in range(steps):
        turn = matrix_from_quat(quat)
        spin = np.asarray(np.linalg.solve(turn @ inertia @ turn.T, momentum), np.float64)
        speed = float(np.linalg.norm(spin))
        quat = quat_multiply(quat_from_axis_angle(spin / speed, np.array(speed * seconds / steps)), quat)
    return quat, spin
