"""Checks of a running simulation: time, reproducibility, batches, divergence and closing."""

from __future__ import annotations

import time

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle, Simulation
from frobs_core.util.arrays import Floats
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, after, expect, second_close
from frobs_devkit.testing.compare import expect_close, expect_same
from frobs_devkit.testing.simulator.robots import LIFT
from frobs_devkit.testing.simulator.under_test import (
    TIMESTEP,
    SimulatorUnderTest,
    expect_state,
    move,
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
