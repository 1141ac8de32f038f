"""Checks of a paced simulator: its world runs on its own, steps wait for the world, and resets drive the robot home."""

from __future__ import annotations

import time

import numpy as np

from frobs_core.contracts import Pacer, Simulation
from frobs_devkit.testing.checks import CheckFailure, Inconclusive, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.simulator.under_test import TIMESTEP, SimulatorUnderTest, verifies

_SLACK = 0.2  # [s], additional time that a busy machine may need


@verifies("real_time")
def paced_worlds_are_single(subject: SimulatorUnderTest) -> None:
    """A paced simulator has a pacer and does not claim the capabilities ``pause`` and ``batched``."""
    for capability in ("pause", "batched"):
        expect(not subject.level(capability), f"the record claims both 'real_time' and '{capability}'.")
    with subject.build() as (sim, _):
        _pacer(sim)


@verifies("real_time")
def steps_wait_for_the_world(subject: SimulatorUnderTest) -> None:
    """A step returns after the world has advanced by the step's duration, and ``time`` is the world's time."""
    with subject.build() as (sim, _):
        expect_close(np.zeros(1), sim.time, 0.0, "time after a reset [s]")
        sim.step(10)
        start, before = time.monotonic(), float(sim.time[0])
        for _ in range(20):
            sim.step(10)
        took, passed, duration = time.monotonic() - start, float(sim.time[0]) - before, 200 * TIMESTEP
        expect(
            took >= 0.95 * duration,
            f"steps of {duration} s returned after only {took:.3f} s; steps must wait for the world.",
        )
        expect(
            passed >= duration - 1e-9,
            f"the simulation's time advanced by only {passed:.3f} s in steps of {duration} s.",
        )
        expect_close(took, passed, _SLACK, "advance of the simulation's time, compared with the wall clock [s]")


@verifies("real_time")
def the_world_moves_on_by_itself(subject: SimulatorUnderTest) -> None:
    """The robot follows a command between steps, because the world does not wait for steps."""
    with subject.build() as (sim, robot):
        robot.command(robot.home + 0.5)
        sim.step(1)
        before = robot.joint_positions.copy()
        time.sleep(0.3)
        sim.step(1)
        moved = float(np.abs(robot.joint_positions - before).max())
        expect(
            moved > 0.1,
            f"the joints moved by only {moved:.3f} in 0.3 s between two steps, although they were commanded to move by "
            "0.5; the world must not wait for steps.",
        )


@verifies("real_time")
def missed_deadlines_are_reported(subject: SimulatorUnderTest) -> None:
    """A late step increases ``time`` and the pacer's ``missed`` and ``lateness``, which a reset sets back to 0."""
    duration, pause = 10 * TIMESTEP, 0.2
    with subject.build() as (sim, _):
        pacer = _pacer(sim)
        sim.step(10)
        sim.step(10)
        missed, lateness, before, start = pacer.missed, pacer.lateness, float(sim.time[0]), time.monotonic()
        time.sleep(pause)
        waited = time.monotonic() - start
        sim.step(10)
        late, count = pacer.lateness - lateness, pacer.missed - missed
        least = pause - 2 * duration  # the previous step may have returned almost one step duration late
        expect(
            late >= least, f"a step {waited:.3f} s after the previous step increases 'lateness' by only {late:.3f} s."
        )
        expect(count >= least / duration, f"a step {late:.3f} s after its deadline increases 'missed' by only {count}.")
        expect_close(before + (1 + count) * duration, sim.time[0], 1e-6, "time after a step that missed deadlines [s]")
        sim.reset()
        expect(not pacer.missed and not pacer.lateness, "a reset does not clear 'missed' and 'lateness'.")


@verifies("real_time")
def resets_drive_home(subject: SimulatorUnderTest) -> None:
    """A reset takes as long as the joints need to move home, and returns when the robot is at rest at home."""
    with subject.build() as (sim, robot):
        robot.command(robot.home + 1.2)
        sim.step(500)
        away = np.abs(robot.joint_positions - robot.home)
        if away.max() < 0.5:
            raise Inconclusive("the robot did not move far enough away from its home position")
        least = float((away / robot.velocity_limit).max())
        start = time.monotonic()
        sim.reset()
        took = time.monotonic() - start
        expect(took >= least, f"the reset took {took:.3f} s, but the joints need at least {least:.3f} s.")
        expect_close(
            robot.home, robot.joint_positions, subject.at_home, "joint_positions after a reset, compared with home"
        )
        expect_close(np.zeros_like(away), robot.joint_velocities, subject.at_home, "joint_velocities after a reset")
        sim.step(100)
        expect_close(robot.home, robot.joint_positions, subject.at_home, "joint_positions 0.2 s after a reset")


def _pacer(sim: Simulation) -> Pacer:
    if sim.pacer is None:
        raise CheckFailure("the record claims 'real_time', but the simulation's 'pacer' is None.")
    return sim.pacer
