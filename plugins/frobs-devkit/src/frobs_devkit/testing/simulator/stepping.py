"""Checks of a running simulation: time, reproducibility, batches, state, snapshots, divergence and closing."""

from __future__ import annotations

import time
from copy import deepcopy

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle, Simulation
from frobs_core.description import Robot
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SimulationError
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, after, expect, expect_raises, second_close
from frobs_devkit.testing.compare import expect_close, expect_same
from frobs_devkit.testing.simulator.robots import ARM, LIFT
from frobs_devkit.testing.simulator.under_test import (
    BALL,
    TILTED,
    TIMESTEP,
    WEIGHTLESS,
    SimulatorUnderTest,
    expect_state,
    move,
    spread,
    state_of,
    verifies,
)


def time_counts_steps(subject: SimulatorUnderTest) -> None:
    """``time`` equals the number of physics steps since the last reset, multiplied by ``physics_timestep``."""
    if subject.record.is_paced:
        raise NotApplicable("the simulator is paced, so the check steps_wait_for_the_world verifies its time instead")
    with subject.build() as (sim, _):
        subject.expect_each(0.0, sim.time, 0.0, "time after a reset [s]")
        sim.step(3)
        sim.step(7)
        subject.expect_each(10 * TIMESTEP, sim.time, 1e-9, "time after 10 steps [s]")


@after("command_rows_are_steps")
def updates_come_between_steps(subject: SimulatorUnderTest) -> None:
    """``step_with`` calls its function before each physics step except the first, and new commands act at once."""
    subject.require_steps()
    efforts = np.array([[5.0, 0.1], [-9.0, 0.3], [20.0, -0.2], [1.0, 0.4]])  # (decimation, dof)
    velocities, times = [], []
    for rows in (True, False):
        with subject.build(LIFT, mode=CommandMode.EFFORT, num_threads=1) as (sim, robot):
            n = sim.num_envs
            if rows:
                robot.command(np.tile(efforts, (n, 1, 1)))
                sim.step(4)
            else:

                def update(sim: Simulation = sim, robot: RobotHandle = robot) -> None:
                    times.append(sim.time.copy())
                    robot.command(np.tile(efforts[min(len(times), 3)], (sim.num_envs, 1)))

                robot.command(np.tile(efforts[0], (n, 1)))
                sim.step_with(4, update)
            velocities.append(robot.joint_velocities.copy())
    expected = TIMESTEP * np.arange(1, 4)[:, None].repeat(n, axis=1)
    expect_close(expected, times, 1e-9, "times at which step_with(4, …) calls its function [s]")
    what = "velocities after commands in step_with, compared with one command with a row per step"
    expect_close(velocities[0], velocities[1], 1e-9, what)


@verifies("determinism")
def motion_repeats(subject: SimulatorUnderTest) -> None:
    """The same commands produce the same motion in a new simulation, after a reset, and with one or two threads."""
    traces = []
    for threads in (1, 2):
        with subject.build(bodies=subject.free_bodies, num_threads=threads) as (sim, robot):
            for _ in range(2):
                sim.reset()
                robot.command(robot.home)
                traces.append(move(sim, robot, 8))
    for k, trace in enumerate(traces[1:]):
        expect_state(subject, traces[0], trace, ("after a reset", "with two threads", "after a reset, two threads")[k])


@verifies("batched")
def rows_equal_singles(subject: SimulatorUnderTest) -> None:
    """With the same commands, environment i of a batch moves like a simulation with a single environment."""
    with subject.build(bodies=subject.free_bodies) as (sim, robot):
        n = sim.num_envs
        expected = move(sim, robot, 8)
    for i in range(n):
        with subject.build(bodies=subject.free_bodies, num_envs=1) as (sim, robot):
            alone = move(sim, robot, 8, rows=n, row=i)
        row = {name: array[[i]] for name, array in expected.items()}
        expect_state(subject, row, alone, f"a single simulation compared with environment {i} of {n}")


@verifies("pause")
def time_stands_between_steps(subject: SimulatorUnderTest) -> None:
    """Nothing moves between steps."""
    with subject.build() as (sim, robot):
        move(sim, robot, 2)
        before = state_of(sim, robot)
        time.sleep(0.05)
        expect_same(before, state_of(sim, robot), "the state 50 ms after a step, without another step")


@verifies("spawn")
def spawning_is_seen(subject: SimulatorUnderTest) -> None:
    """Bodies can be added to a running simulation."""
    raise Inconclusive("the simulation contract does not yet support adding bodies to a running simulation")


@verifies("teleport")
def divergence_is_contained(subject: SimulatorUnderTest) -> None:
    """A diverging environment is reported in ``diverged`` and does not affect the others."""
    n = subject.num_envs
    if n == 1:
        raise NotApplicable("the simulator has only one environment")
    with subject.build(mode=CommandMode.EFFORT) as (sim, robot):
        expect(sim.diverged is None or not sim.diverged.any(), "diverged is not empty after a reset.")
        sim.step(40)
        expected = state_of(sim, robot)
    for speed in (1e150, np.nan):
        _expect_contained(subject, speed, expected)


def _expect_contained(subject: SimulatorUnderTest, speed: float, expected: dict[str, Floats]) -> None:
    with subject.build(mode=CommandMode.EFFORT) as (sim, robot):
        first = np.arange(sim.num_envs) == 0
        robot.write_joint_state(robot.home[:1], np.full((1, 2), speed), first)
        sim.step(40)
        state = state_of(sim, robot)
        for name in expected:
            expect_same(
                expected[name][1:], state[name][1:], f"{name} of the other environments while environment 0 diverges"
            )
        diverged = sim.diverged
        noted = diverged is not None and bool(diverged[0])
        sound = np.isfinite(state["positions"][0]).all() and np.abs(state["positions"][0]).max() < 1e6
        expect(noted or sound, f"environment 0 diverged to {state['positions'][0]}, but 'diverged' does not report it.")
        expect(diverged is None or not diverged[1:].any(), "'diverged' reports environments that did not diverge.")
        sim.reset(first)
        expect(sim.diverged is None or not sim.diverged.any(), "'diverged' is not cleared by the reset.")
        expect_close(robot.home[0], robot.joint_positions[0], 1e-9, "joint positions of environment 0 after its reset")


def close_twice(subject: SimulatorUnderTest) -> None:
    """Closing a simulation a second time has no effect."""
    with second_close(), subject.build() as (sim, _):
        sim.close()  # the end of the block closes the simulation again


FLOATING = Robot(model="kit_arm", name="kit_arm", tcp="tool", base="floating", gains=ARM.gains)


@verifies("teleport")
def joints_are_placed(subject: SimulatorUnderTest) -> None:
    """Written joint states can be read back and affect only the environments selected by the mask."""
    with subject.build() as (sim, robot):
        n = sim.num_envs
        q, v = spread(-1, 1, (n, 2)), spread(-1, 1, (n, 2), seed=1)
        robot.write_joint_state(q, v)
        expect_close(q, robot.joint_positions, 1e-12, "written joint_positions")
        expect_close(v, robot.joint_velocities, 1e-12, "written joint_velocities")
        mask = np.arange(n) == n - 1
        robot.write_joint_state(np.array([[0.25, -0.5]]), 0.0, mask)
        q[mask], v[mask] = [0.25, -0.5], 0.0
        expect_close(q, robot.joint_positions, 1e-12, "joint_positions after writing to the last environment")
        expect_close(v, robot.joint_velocities, 1e-12, "joint_velocities after writing to the last environment")


@verifies("teleport")
def floating_bases_fly(subject: SimulatorUnderTest) -> None:
    """A floating base keeps a twist that is written to it and falls under gravity. A fixed base rejects a twist."""
    with subject.build(FLOATING, pose=TILTED, gravity=WEIGHTLESS, floor=False) as (sim, robot):
        n = sim.num_envs
        linear, angular = spread(-1, 1, (n, 3)), spread(-1, 1, (n, 3), seed=1)
        robot.write_base_twist(linear, angular)
        for name, expected, actual in zip(("lin", "ang"), (linear, angular), robot.base_twist, strict=True):
            expect_close(expected, actual, 1e-9, f"{name}_vel_world of the base after it was written")
        robot.write_base_twist(linear, np.zeros((n, 3)))
        before = robot.base_pose[0].copy()
        sim.step(1)
        what = "position of the base one step after writing a twist [m]"
        expect_close(before + TIMESTEP * linear, robot.base_pose[0], 1e-4, what)
    with subject.build(FLOATING, floor=False) as (sim, robot):
        sim.step(50)
        fallen = np.tile([0.0, 0.0, -9.81 * 50 * TIMESTEP], (sim.num_envs, 1))
        expect_close(fallen, robot.base_twist[0], 0.05, "lin_vel_world of a base after falling for 0.1 s [m/s]")
    with subject.build() as (sim, robot), expect_raises(SimulationError, "write_base_twist on a fixed base"):
        robot.write_base_twist(np.zeros((sim.num_envs, 3)), np.zeros((sim.num_envs, 3)))


def reset_honours_the_mask(subject: SimulatorUnderTest) -> None:
    """A reset affects only environments selected by its mask, sets time to 0, and leaves the robot at rest at home."""
    with subject.build(bodies=subject.free_bodies) as (sim, robot):
        n = sim.num_envs
        robot.command(robot.home + 0.4)
        sim.step(25)
        mask = np.arange(n) == 0
        before = deepcopy(state_of(sim, robot))
        sim.reset(mask)
        after = state_of(sim, robot)
        for name in before:
            expect_same(before[name][1:], after[name][1:], f"{name} of the environments that were not reset")
        near = subject.at_home
        expect_close(robot.home[0], robot.joint_positions[0], near, "joint_positions of the reset environment")
        expect_close(np.zeros(2), robot.joint_velocities[0], near, "joint_velocities of the reset environment")
        expect_close(0.0, sim.time[0], 0.0, "time of the reset environment [s]")
        if sim.bodies and not subject.record.is_paced:  # a reset of a paced simulator does not move bodies
            place = np.array(BALL.pose.pos)
            expect_close(place, sim.bodies["ball"].pose[0][0], 1e-12, "position of the ball after its reset [m]")
        sim.reset()
        sim.step(100)
        expect_close(robot.home, robot.joint_positions, 0.05, "joint_positions 0.2 s after a reset, compared with home")


@verifies("snapshot")
def snapshots_continue(subject: SimulatorUnderTest) -> None:
    """After a restore, the motion continues exactly as before, even in another simulation of the same configuration."""
    with subject.build(bodies=subject.free_bodies) as (sim, robot):
        move(sim, robot, 3)
        snapshot = deepcopy(sim.snapshot())
        held = state_of(sim, robot)
        expected = move(sim, robot, 6, seed=5)
        sim.restore(deepcopy(snapshot))
        expect_state(subject, held, state_of(sim, robot), "the restored state")
        expect_state(subject, expected, move(sim, robot, 6, seed=5), "the continuation")
    with subject.build(bodies=subject.free_bodies) as (sim, robot):
        sim.restore(deepcopy(snapshot))
        expect_state(subject, expected, move(sim, robot, 6, seed=5), "the continuation in another simulation")
