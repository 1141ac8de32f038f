"""Checks of a simulation's state: writing, resets, snapshots, repetition, batches, divergence, the end."""

from __future__ import annotations

import time
from copy import deepcopy
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.capabilities import Level
from frobs_core.errors import SimulationError
from frobs_core.interfaces import CommandMode, Robot, RobotHandle, Simulation
from frobs_core.testing.checks import CheckFailure, Hollow, NotApplicable, Outcome, expect
from frobs_core.testing.compare import expect_close, expect_same
from frobs_core.testing.simulator.robots import ARM
from frobs_core.testing.simulator.subject import BALL, TIMESTEP, SimulatorUnderTest, spread, verifies

_FLOATING = Robot(model="kit_arm", name="kit_arm", tcp="tool", base="floating", gains=ARM.gains)


def time_counts_steps(subject: SimulatorUnderTest) -> Outcome:
    """``time`` is the steps since the reset times ``physics_timestep``."""
    with subject.build() as (sim, _):
        expect_close(np.zeros(sim.num_envs), sim.time, 0.0, "time after a reset [s]")
        sim.step(3)
        sim.step(7)
        expect_close(np.full(sim.num_envs, 10 * TIMESTEP), sim.time, 1e-9, "time after 10 steps [s]")
    return None


@verifies("teleport")
def joints_are_placed(subject: SimulatorUnderTest) -> Outcome:
    """Joint states that are written read back the same; a mask leaves the others alone."""
    with subject.build() as (sim, robot):
        n = sim.num_envs
        q, v = spread(-1, 1, (n, 2)), spread(-1, 1, (n, 2), seed=1)
        robot.write_joint_state(q, v)
        expect_close(q, robot.joint_positions, 1e-12, "joint_positions that were written")
        expect_close(v, robot.joint_velocities, 1e-12, "joint_velocities that were written")
        mask = np.arange(n) == n - 1
        robot.write_joint_state(np.array([[0.25, -0.5]]), 0.0, mask)
        q[mask], v[mask] = [0.25, -0.5], 0.0
        expect_close(q, robot.joint_positions, 1e-12, "joint_positions after writing to the last environment")
        expect_close(v, robot.joint_velocities, 1e-12, "joint_velocities after writing to the last environment")
    return None


@verifies("teleport")
def floating_bases_fly(subject: SimulatorUnderTest) -> Outcome:
    """A floating base keeps a twist that is written, falls by the closed form, and a fixed base refuses a twist."""
    with subject.build(_FLOATING, gravity=(0.0, 0.0, 0.0), floor=False) as (sim, robot):
        n = sim.num_envs
        linear, angular = spread(-1, 1, (n, 3)), spread(-1, 1, (n, 3), seed=1)
        robot.write_base_twist(linear, angular)
        for name, wanted, found in zip(("lin", "ang"), (linear, angular), robot.base_twist, strict=True):
            expect_close(wanted, found, 1e-9, f"{name}_vel_world of the base that was written")
        robot.write_base_twist(linear, np.zeros((n, 3)))
        before = robot.base_pose[0].copy()
        sim.step(1)
        expect_close(
            before + TIMESTEP * linear, robot.base_pose[0], 1e-4, "the base's position a step after a twist [m]"
        )
    with subject.build(_FLOATING, floor=False) as (sim, robot):
        sim.step(50)
        fallen = np.tile([0.0, 0.0, -9.81 * 50 * TIMESTEP], (sim.num_envs, 1))
        momentum_speed = robot.base_twist[0]
        expect_close(fallen, momentum_speed, 0.05, "lin_vel_world of a base that falls for 0.1 s [m/s]")
    with subject.build() as (sim, robot):
        try:
            robot.write_base_twist(np.zeros((sim.num_envs, 3)), np.zeros((sim.num_envs, 3)))
        except SimulationError:
            return None
    raise CheckFailure("write_base_twist passes on a fixed base; it must raise SimulationError.")


def reset_honours_the_mask(subject: SimulatorUnderTest) -> Outcome:
    """A reset puts the environments of its mask back to home, at rest, at time 0, drives holding, and no others."""
    with subject.build(bodies={"ball": BALL}) as (sim, robot):
        n = sim.num_envs
        robot.command(robot.home + 0.4)
        sim.step(25)
        mask = np.arange(n) == 0
        before = deepcopy(_state(sim, robot))
        sim.reset(mask)
        after = _state(sim, robot)
        for name in before:
            expect_same(before[name][1:], after[name][1:], f"{name} of the environments that were not reset")
        expect_close(
            robot.home[0], robot.joint_positions[0], 1e-12, "joint_positions of the environment that was reset"
        )
        expect_close(np.zeros(2), robot.joint_velocities[0], 0.0, "joint_velocities of the environment that was reset")
        expect_close(0.0, sim.time[0], 0.0, "time of the environment that was reset [s]")
        expect_close(np.array(BALL.pose.pos), sim.bodies["ball"].pose[0][0], 1e-12, "the ball that was reset [m]")
        sim.reset()
        sim.step(100)
        expect_close(
            robot.home, robot.joint_positions, 0.05, "joint_positions 0.2 s after a reset: the drives hold home"
        )
    return None


@verifies("snapshot")
def snapshots_continue(subject: SimulatorUnderTest) -> Outcome:
    """A simulation that is restored continues exactly, and so does another that was built alike."""
    with subject.build(bodies={"ball": BALL}) as (sim, robot):
        _move(sim, robot, 3)
        snapshot = deepcopy(sim.snapshot())
        held = _state(sim, robot)
        expected = _move(sim, robot, 6, seed=5)
        sim.restore(deepcopy(snapshot))
        _expect_state(subject, held, _state(sim, robot), "the state that was restored")
        _expect_state(subject, expected, _move(sim, robot, 6, seed=5), "the continuation")
    with subject.build(bodies={"ball": BALL}) as (sim, robot):
        sim.restore(deepcopy(snapshot))
        _expect_state(subject, expected, _move(sim, robot, 6, seed=5), "the continuation in another simulation")
    return None


@verifies("determinism")
def motion_repeats(subject: SimulatorUnderTest) -> Outcome:
    """The same commands give the same motion, in a simulation built anew, after a reset, and at 1 and 2 threads."""
    traces = []
    for threads in (1, 2):
        with subject.build(bodies={"ball": BALL}, num_threads=threads) as (sim, robot):
            for _ in range(2):
                sim.reset()
                robot.command(robot.home)
                traces.append(_move(sim, robot, 8))
    for k, trace in enumerate(traces[1:]):
        _expect_state(subject, traces[0], trace, ("after a reset", "with two threads", "after a reset, two threads")[k])
    return None


@verifies("batched")
def rows_equal_singles(subject: SimulatorUnderTest) -> Outcome:
    """Environment i of a batch moves as a simulation of one does that is commanded the same."""
    with subject.build(bodies={"ball": BALL}) as (sim, robot):
        n = sim.num_envs
        expected = _move(sim, robot, 8)
    for i in range(n):
        with subject.build(bodies={"ball": BALL}, num_envs=1) as (sim, robot):
            found = _move(sim, robot, 8, rows=n, row=i)
        row = {name: array[[i]] for name, array in expected.items()}
        _expect_state(subject, row, found, f"a single simulation against environment {i} of {n}")
    return None


@verifies("pause")
def time_stands_between_steps(subject: SimulatorUnderTest) -> Outcome:
    """Nothing moves while nobody steps."""
    with subject.build() as (sim, robot):
        _move(sim, robot, 2)
        before = _state(sim, robot)
        time.sleep(0.05)
        expect_same(before, _state(sim, robot), "the state 50 ms later, without a step")
    return None


@verifies("real_time")
def steps_take_their_time(subject: SimulatorUnderTest) -> Outcome:
    """A step takes as long as it simulates."""
    with subject.build() as (sim, _):
        start = time.perf_counter()
        sim.step(100)
        expect_close(100 * TIMESTEP, time.perf_counter() - start, 0.1, "how long 0.2 s of simulation took [s]")
    return None


@verifies("spawn")
def spawning_is_seen(subject: SimulatorUnderTest) -> Outcome:
    """Bodies can be added while it runs."""
    return Hollow("the simulation contract has no way yet to ask for it")


@verifies("teleport")
def divergence_is_contained(subject: SimulatorUnderTest) -> Outcome:
    """An environment whose numbers blow up is told of in ``diverged``, and the others go on as if nothing were."""
    n = subject.num_envs
    if n == 1:
        return NotApplicable("the simulator holds one environment")
    with subject.build(mode=CommandMode.EFFORT) as (sim, robot):
        expect(sim.diverged is None or not sim.diverged.any(), "diverged is not empty after a reset.")
        sim.step(40)
        expected = _state(sim, robot)
    with subject.build(mode=CommandMode.EFFORT) as (sim, robot):
        robot.write_joint_state(robot.home[:1], np.full((1, 2), 1e150), np.arange(n) == 0)
        sim.step(40)
        found = _state(sim, robot)
        for name in expected:
            expect_same(expected[name][1:], found[name][1:], f"{name} of the others while environment 0 diverges")
        diverged = sim.diverged
        told = diverged is not None and bool(diverged[0])
        sound = np.isfinite(found["positions"][0]).all() and np.abs(found["positions"][0]).max() < 1e6
        expect(told or sound, f"environment 0 diverged to {found['positions'][0]}, and 'diverged' does not tell.")
        expect(diverged is None or not diverged[1:].any(), "'diverged' tells of environments that are sound.")
        sim.reset(np.arange(n) == 0)
        expect(sim.diverged is None or not sim.diverged.any(), "'diverged' stays after the reset.")
    return None


def close_twice(subject: SimulatorUnderTest) -> Outcome:
    """Closing twice is harmless."""
    try:
        with subject.build() as (sim, _):
            sim.close()  # and once more at the end of the block
    except Exception as error:
        raise CheckFailure(f"the second close() raises {type(error).__name__}: {error}; let it do nothing.") from error
    return None


def _state(sim: Simulation, robot: RobotHandle) -> dict[str, Floats]:
    state: dict[str, Any] = {
        "positions": robot.joint_positions,
        "velocities": robot.joint_velocities,
        "time": sim.time,
        "tcp": robot.frame_pose("tcp")[0],
    }
    for name, body in sim.bodies.items():
        state[f"{name}_pos"], state[f"{name}_quat"] = body.pose
        state[f"{name}_lin_vel"], state[f"{name}_ang_vel"] = body.twist
    return {name: np.array(array) for name, array in state.items()}


def _move(
    sim: Simulation, robot: RobotHandle, steps: int, seed: int = 0, rows: int | None = None, row: int | None = None
) -> dict[str, Floats]:
    """Command drawn positions; ``row`` of ``rows`` where one environment stands for one of a batch."""
    for k in range(steps):
        drawn = spread(-0.6, 0.6, (rows or sim.num_envs, 2), seed=seed + k)
        robot.command(robot.home + (drawn if row is None else drawn[[row]]))
        sim.step(10)
    return _state(sim, robot)


def _expect_state(
    subject: SimulatorUnderTest, expected: dict[str, Floats], found: dict[str, Floats], what: str
) -> None:
    for name, array in expected.items():
        if subject.level("determinism") == Level.EXACT:
            expect_same(array, found[name], f"{what}: {name}")
        else:
            expect_close(array, found[name], 0.02, f"{what}: {name}")
