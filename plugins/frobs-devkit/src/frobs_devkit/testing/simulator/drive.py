"""Checks of the drive law against its closed-form solution, and of how drives hold commands."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.models import Pose
from frobs_core.util.arrays import Floats
from frobs_devkit.testing.checks import Inconclusive, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.simulator.robots import LIFT, LIFT_EFFORT_LIMIT, LIFT_INERTIA, LIFT_WEIGHT, ROVER
from frobs_devkit.testing.simulator.under_test import TIMESTEP, WEIGHTLESS, SimulatorUnderTest, verifies

_GRAVITY = 9.81


@verifies("drive")
def drives_follow_positions(subject: SimulatorUnderTest) -> None:
    """Under position commands, unsaturated joints follow (M + h·Kd)·a = Kp·(q* − q) − Kd·q̇ − b in each step."""
    _expect_law(subject, CommandMode.POSITION, (0.05, 0.4))


@verifies("drive")
def drives_saturate(subject: SimulatorUnderTest) -> None:
    """A joint follows M·a = ±limit − b in each step in which the explicitly computed effort exceeds the limit."""
    _expect_law(subject, CommandMode.POSITION, (0.4, 3.0), saturates=True)


@verifies("drive")
def drives_follow_velocities(subject: SimulatorUnderTest) -> None:
    """A velocity command v* produces the effort Kd·(v* − q̇), without a stiffness term."""
    _expect_law(subject, CommandMode.VELOCITY, (0.3, 2.0))


@verifies("drive")
def drives_apply_efforts(subject: SimulatorUnderTest) -> None:
    """Effort commands are clipped to the effort limit, applied, and returned as ``joint_efforts``."""
    _expect_law(subject, CommandMode.EFFORT, (35.0, 9.0), saturates=True, reads_effort=True)


@verifies("drive")
def command_rows_are_steps(subject: SimulatorUnderTest) -> None:
    """A command with one row per physics step acts like a sequence of commands, and its last row is held."""
    subject.require_steps()
    traces = []
    rows = np.stack([np.linspace(0.0, 0.1, 6), np.linspace(0.5, -0.5, 6)], axis=-1)  # (6, dof)
    for together in (True, False):
        with subject.build(LIFT) as (sim, robot):
            if together:
                robot.command(np.broadcast_to(rows, (sim.num_envs, 6, 2)).copy())
                sim.step(6)
            else:
                for row in rows:
                    robot.command(np.broadcast_to(row, (sim.num_envs, 2)).copy())
                    sim.step(1)
            sim.step(3)
            traces.append(np.concatenate([robot.joint_positions, robot.joint_velocities], axis=1))
    what = "the state after one command with 6 rows, compared with the state after 6 commands with one row"
    expect_close(traces[1], traces[0], subject.tolerance("drive"), what)


@verifies("drive")
def commands_are_kept(subject: SimulatorUnderTest) -> None:
    """A command is copied, so later changes to the command's array have no effect."""
    with subject.build(LIFT) as (sim, robot):
        command = np.full((sim.num_envs, 2), 0.1)
        robot.command(command)
        command[:] = -0.1
        sim.step(20)
        expect(
            (robot.joint_positions > 0).all(),
            "changing the array after command() has returned changes the command; the simulation must copy the array.",
        )


@verifies("drive")
def a_new_mode_holds(subject: SimulatorUnderTest) -> None:
    """After ``set_command_mode``, the robot holds its position or stays at rest until the next command."""
    with subject.build(LIFT, gravity=WEIGHTLESS) as (sim, robot):
        robot.command(np.full((sim.num_envs, 2), 0.3))
        sim.step(600)
        there = robot.joint_positions.copy()
        for mode in (CommandMode.VELOCITY, CommandMode.EFFORT, CommandMode.POSITION):
            robot.set_command_mode(mode)
            expect(robot.command_mode == mode, f"command_mode is {robot.command_mode} after set_command_mode({mode}).")
            sim.step(200)
            expect_close(there, robot.joint_positions, 2e-3, f"joint positions held after set_command_mode({mode})")


@verifies("contacts")
def wheels_roll(subject: SimulatorUnderTest) -> None:
    """A wheeled robot's speed equals the angular velocity of its wheels times the wheel radius."""
    with subject.build(ROVER, mode=CommandMode.VELOCITY, pose=Pose(pos=(0.0, 0.0, 0.051))) as (sim, robot):
        robot.command(np.full((sim.num_envs, 2), 6.0))
        sim.step(500)
        forward = robot.base_twist[0][:, 0]
        subject.expect_each(6.0, robot.joint_velocities[:, 0], 0.3, "velocity of the wheels [rad/s]")
        subject.expect_each(0.3, forward, 0.02, "velocity of a rover with a wheel radius of 0.05 m [m/s]")


def _expect_law(
    subject: SimulatorUnderTest,
    mode: CommandMode,
    target: tuple[float, float],
    *,
    saturates: bool = False,
    reads_effort: bool = False,
) -> None:
    inertia, weight, limit = np.array(LIFT_INERTIA), np.array(LIFT_WEIGHT) * _GRAVITY, np.array(LIFT_EFFORT_LIMIT)
    assert LIFT.gains is not None
    kp, kd = np.array([LIFT.gains.of(name) for name in ("lift", "turn")]).T
    tolerance = subject.tolerance("drive", exact=1e-9)
    subject.require_steps()
    if mode != CommandMode.POSITION:
        kp = np.zeros(2)
    with subject.build(LIFT, mode=mode) as (sim, robot):
        scale = 1.0 - 0.1 * np.arange(sim.num_envs)[:, None]
        command: Floats = scale * np.array(target)  # (num_envs, dof)
        robot.command(command)
        q, v = robot.joint_positions.copy(), robot.joint_velocities.copy()
        start, saturated, free = q.copy(), False, False
        for k in range(60):
            if mode == CommandMode.EFFORT:
                effort, damping = command, np.zeros(2)
            else:
                spring = kp * (command - q) if mode == CommandMode.POSITION else kd * command
                effort, damping = spring - kd * v, kd
            over = np.abs(effort) > limit
            saturated, free = saturated or bool(over.any()), free or not bool(over.all())
            effort = np.clip(effort, -limit, limit)
            v = v + TIMESTEP * (effort - weight) / (inertia + np.where(over, 0.0, TIMESTEP * damping))
            q = q + TIMESTEP * v
            sim.step(1)
            expect_close(v, robot.joint_velocities, 100 * tolerance, f"{mode} command, velocities of step {k + 1}")
            expect_close(q, robot.joint_positions, tolerance, f"{mode} command, joint positions of step {k + 1}")
            if over.any():
                limits = np.broadcast_to(effort, over.shape)
                what = f"saturated joint_efforts of step {k + 1}"
                expect_close(limits[over], robot.joint_efforts[over], max(tolerance, 1e-6), what)
            if reads_effort:
                expect_close(effort, robot.joint_efforts, max(tolerance, 1e-6), f"joint_efforts of step {k + 1}")
        if np.abs(q - start).max() < 1e-3:
            raise Inconclusive("no joint moved")
        if not free or saturated != saturates:
            raise Inconclusive("the joint efforts did not saturate as intended, so the drive law was not verified")
