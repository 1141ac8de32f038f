"""Checks of writing, resetting and saving a simulation's state."""

from __future__ import annotations

from copy import deepcopy

import numpy as np

from frobs_core.description import Robot
from frobs_core.util.errors import SimulationError
from frobs_devkit.testing.checks import expect_raises
from frobs_devkit.testing.compare import expect_close, expect_same
from frobs_devkit.testing.simulator.robots import ARM
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
