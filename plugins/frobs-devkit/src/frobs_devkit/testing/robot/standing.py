"""Checks of how a robot stands in a simulator."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from frobs_core.capabilities import Level
from frobs_core.interfaces import CommandMode, Contact, Scene
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, expect
from frobs_devkit.testing.compare import expect_close, expect_same_pose, placed
from frobs_devkit.testing.robot.subject import TIMESTEP, RobotUnderTest

_SAG = 0.05  # [rad or m] that gravity may pull a robot off its home


def frames_agree(subject: RobotUnderTest) -> None:
    """The simulator puts every link where the model file does, for joint positions within the limits."""
    with subject.build() as (_, robot):
        model = subject.model
        expect(robot.joint_names == model.joint_names, f"joint_names is {robot.joint_names}, not {model.joint_names}.")
        low = np.maximum(robot.position_lower[0], -3.0)
        high = np.minimum(robot.position_upper[0], 3.0)
        drawn = low + (high - low) * np.random.default_rng(0).uniform(size=(5, robot.dof))
        for link in model.links:
            wanted = placed(robot.base_pose, model.frame_pose(link.name, drawn))
            expect_same_pose(wanted, robot.frame_pose(link.name, drawn), 1e-6, f"link '{link.name}'")


def home_is_held(subject: RobotUnderTest) -> None:
    """Commanded home, the robot stays there for a second under gravity; a wheeled one stands."""
    with subject.build() as (sim, robot):
        if subject.robot.base == "floating":
            raise NotApplicable("a floating base falls")
        robot.command(robot.home.copy())
        start = robot.base_pose[0].copy()
        sim.step(round(1.0 / TIMESTEP))
        if subject.robot.base == "wheeled":
            expect_close(start, robot.base_pose[0], 0.02, "the base's position after 1 s [m]")
            return
        names = ", ".join(robot.joint_names)
        expect_close(robot.home, robot.joint_positions, _SAG, f"joint positions ({names}) after 1 s, against home")
        expect_close(np.zeros_like(robot.home), robot.joint_velocities, 0.05, f"joint velocities ({names}) after 1 s")


def joints_follow(subject: RobotUnderTest) -> None:
    """Commanded a little off home, each joint by itself gets there; a wheeled robot's wheels turn the way commanded."""
    if subject.robot.base == "floating":
        raise NotApplicable("a floating base falls")
    wheeled = subject.robot.base == "wheeled"
    with subject.build() as (sim, robot):
        names = robot.joint_names
        if wheeled:
            robot.set_command_mode(CommandMode.VELOCITY)
        for joint, name in enumerate(names):
            sim.reset()
            low, high = robot.position_lower[0, joint], robot.position_upper[0, joint]
            step = 0.1 if robot.home[0, joint] + 0.1 <= high else max(-0.1, low - robot.home[0, joint])
            command = np.zeros_like(robot.home) if wheeled else robot.home.copy()
            command[0, joint] += 1.0 if wheeled else step
            before = robot.joint_positions.copy()
            robot.command(command)
            sim.step(round(1.0 / TIMESTEP))
            moved = robot.joint_positions - before
            if wheeled:
                expect(
                    moved[0, joint] > 0.1,
                    f"joint '{name}' turns by {moved[0, joint]:.3g} when commanded 1 rad/s for 1 s.",
                )
                continue
            expect_close(command[0, joint], robot.joint_positions[0, joint], _SAG,
                         f"joint '{name}' 1 s after it was commanded {step:+.2g} off home")  # fmt: skip


def home_is_free(subject: RobotUnderTest) -> None:
    """At home no two links touch that are not neighbours."""
    if not subject.robot.self_collision:
        raise NotApplicable("the robot's links do not collide with each other")
    with subject.build() as (sim, _robot):
        overlaps = sim.overlaps()
    if overlaps is not None:
        found = [f"{overlap.first} and {overlap.second}" for overlap in overlaps]
        expect(not found, f"at home these links are in each other: {'; '.join(found)}.")
        return
    assert subject.simulator is not None
    if subject.simulator.capabilities.get("contacts", Level.UNSUPPORTED) == Level.UNSUPPORTED:
        raise Inconclusive(f"simulator '{subject.simulator.name}' tells neither of overlaps nor of contacts")
    model = subject.model
    solid = [link.name for link in model.links if link.collisions]
    beside = {frozenset((joint.parent, joint.child)) for joint in model.joints}
    pairs = [pair for pair in combinations(solid, 2) if frozenset(pair) not in beside]
    if not pairs:
        raise Inconclusive("no two links that are not neighbours have collision shapes")
    contacts = {f"{a} and {b}": Contact(first=f"robot/{a}", second=f"robot/{b}") for a, b in pairs}
    with subject.build(Scene(contacts=contacts)) as (sim, robot):
        robot.command(robot.home.copy())
        sim.step(1)
        touching = [name for name in contacts if sim.contact(name)[0]]
        expect(not touching, f"at home these links touch: {'; '.join(touching)}.")
