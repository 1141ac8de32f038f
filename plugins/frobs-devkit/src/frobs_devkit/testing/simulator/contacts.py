"""Checks of contacts that involve robots."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle, Simulation
from frobs_core.description import Body, Contact
from frobs_core.models import Box, JointType, Pose
from frobs_devkit.testing.checks import after, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.simulator.robots import PILE, ROVER, model_of
from frobs_devkit.testing.simulator.under_test import BALL, WEIGHTLESS, SimulatorUnderTest, verifies

_KERB = Body(geometry=Box((0.2, 0.02, 0.2)), pose=Pose(pos=(0.0, 0.129, 0.1)))  # overlaps the left wheel by 1 mm
_FALL = 60  # physics steps in which a ball falls by 1 cm and bounces
_MASS = 2.0  # [kg]
_BOX = Body(geometry=Box((0.2, 0.2, 0.2)), pose=Pose(pos=(0.0, 2.0, 0.1)), mass=_MASS)
_TURNED = replace(_BOX, pose=Pose(pos=(0.0, 3.0, 0.1), quat_wxyz=(0.5**0.5, 0.5**0.5, 0.0, 0.0)))


@verifies("contacts")
def contacts_of_robots_are_told(subject: SimulatorUnderTest) -> None:
    """A side of a contact can be a robot, a single link or any object, and different links are distinguished."""
    contacts = {
        "left": Contact(first="robot/left_wheel", second="floor"),
        "robot": Contact(first="robot"),
        "pair": Contact(first="robot/left_wheel", second="ball"),
    }
    with _standing_rover(subject, bodies={"ball": BALL}, contacts=contacts) as (sim, _):
        sim.step(20)
        for name, expected in (("left", True), ("robot", True), ("pair", False)):
            touch = sim.contact(name)
            expect((touch == expected).all(), f"contact('{name}') of a rover on the floor has the wrong value {touch}.")


@verifies("contacts")
def contacts_can_ignore(subject: SimulatorUnderTest) -> None:
    """A contact with any object excludes only the floor, bodies and robots that are listed in ``ignore``."""
    contacts = {
        "anything": Contact(first="robot/left_wheel"),
        "except the floor": Contact(first="robot/left_wheel", ignore=("floor",)),
        "except floor and kerb": Contact(first="robot/left_wheel", ignore=("floor", "kerb")),
        "except the robot": Contact(first="floor", ignore=("kerb", "robot")),
        "right wheel": Contact(first="robot/right_wheel", ignore=("floor",)),
    }
    with _standing_rover(subject, bodies={"kerb": _KERB}, contacts=contacts) as (sim, _):
        sim.step(2)
        expected_contacts = (True, True, False, False, False)
        for (name, contact), expected in zip(contacts.items(), expected_contacts, strict=True):
            touch = sim.contact(name)
            what = f"of '{contact.first}' that ignores {', '.join(contact.ignore) or 'nothing'}"
            expect((touch == expected).all(), f"a contact {what} is {touch}, not {expected}.")


@verifies("contacts")
def contacts_end_with_a_reset(subject: SimulatorUnderTest) -> None:
    """After a reset, the environments that the mask selects report no contacts until the next step."""
    contacts = {"standing": Contact(first="robot/left_wheel", second="floor")}
    with _standing_rover(subject, contacts=contacts) as (sim, _):
        sim.step(20)
        expect(sim.contact("standing").all(), "no contact is reported for a rover on the floor.")
        mask = np.arange(sim.num_envs) == 0
        sim.reset(mask)
        touch = sim.contact("standing")
        expect(not touch[0], "a contact from the previous episode is still reported after a reset.")
        expect(touch[1:].all(), f"the reset of environment 0 also ended contacts in other environments: {touch}.")
        expect(
            not sim.contact_force("standing")[0].any(),
            "a contact force from the previous episode is still reported after a reset.",
        )
        sim.step(20)
        expect(sim.contact("standing").all(), "no contact is reported 20 steps after a reset.")


@verifies("contacts", "teleport")
def contacts_are_those_of_all_steps(subject: SimulatorUnderTest) -> None:
    """``step_with`` reports the contacts during all its physics steps, not only during the last step."""
    on_floor = replace(BALL, pose=Pose(pos=(0.0, 2.0, 0.05)))
    contacts = {"ball": Contact(first="ball", second="floor")}
    with subject.build(bodies={"ball": on_floor}, contacts=contacts, num_threads=1) as (sim, _):
        n = sim.num_envs
        sim.step(400)
        force = sim.contact_force("ball").copy()

        def place(height: float) -> None:
            sim.bodies["ball"].write_pose(np.tile([0.0, 2.0, height], (n, 1)))

        sim.step_with(2, lambda: place(1.0))
        expect(
            sim.contact("ball").all(),
            "step_with does not report a contact that occurs only in the first of two physics steps.",
        )
        expect_close(
            force, sim.contact_force("ball"), 0.1 * force.max(), "force of a contact in the first of two steps [N]"
        )
        place(0.06)
        forces = []
        for _ in range(_FALL):
            sim.step(1)
            forces.append(sim.contact_force("ball").copy())
        place(0.06)
        sim.step(_FALL)
        largest = np.max(forces, axis=0)
        what = "largest force of a ball that bounces during a step [N]"
        expect_close(largest, sim.contact_force("ball"), 0.1 * largest.max(), what)


@verifies("contacts")
@after("contacts_end_with_a_reset")
def resultants_are_forces_on_the_first_side(subject: SimulatorUnderTest) -> None:
    """``contact_resultant`` returns the force on a contact's first side in the world frame, including friction."""
    contacts = {
        "box": Contact(first="box", second="floor"),
        "floor": Contact(first="floor", second="box"),
        "anything": Contact(first="box"),
        "turned": Contact(first="turned"),
        "everything": Contact(first="*", second="turned"),
    }
    with subject.build(bodies={"box": _BOX, "turned": _TURNED}, contacts=contacts) as (sim, _):
        n = sim.num_envs
        sim.step(500)
        weight = np.tile([0.0, 0.0, 9.81 * _MASS], (n, 1))
        tolerance = 0.01 * 9.81 * _MASS
        for name, sign in zip(contacts, (1.0, -1.0, 1.0, 1.0, -1.0), strict=True):
            what = f"contact_resultant('{name}') of a box on the floor [N]"
            expect_close(sign * weight, sim.contact_resultant(name), tolerance, what)
            if name != "floor":
                # the box has at most five contact points with the floor: four corners and their center
                low = sim.contact_force(name).min() > weight.max() / 9.0
                expect(low, f"contact_force('{name}') of a box on the floor is too small: {sim.contact_force(name)} N.")
        if subject.level("wrench"):
            push = np.array([3.0, 1.0, 0.0]) * (1.0 + np.arange(n))[:, None] / n
            for body in ("box", "turned"):
                sim.apply_wrench(body, push, np.zeros((n, 3)))
            sim.step(100)
            for name, sign in (("box", 1.0), ("floor", -1.0), ("turned", 1.0)):
                what = f"contact_resultant('{name}') of a box that is pushed but does not slide [N]"
                expect_close(sign * (weight - push), sim.contact_resultant(name), 3.0 * tolerance, what)
        sim.reset()
        expect(
            not sim.contact_resultant("box").any(),
            "the resultant of a contact from the previous episode is still reported after a reset.",
        )


@verifies("contacts")
@after("drives_follow_positions")
def links_collide(subject: SimulatorUnderTest) -> None:
    """Links that are not neighbors stop each other, unless the robot's description disables self-collision."""
    model, reach, gap = model_of(PILE.model), 0.3, 0.18  # [m]
    [turning, sliding] = model.joints
    down = replace(
        sliding,
        type=JointType.PRISMATIC,
        origin=Pose((0.0, 0.0, 0.19)),
        axis=(0.0, 0.0, -1.0),
        limits=replace(sliding.limits, lower=0.0, upper=reach),
    )
    apart = replace(model, joints=(turning, down))
    for collides in (True, False):
        pile = replace(PILE, self_collision=collides)
        with subject.build(pile, model=apart, gravity=WEIGHTLESS, floor=False, num_threads=1) as (sim, robot):
            robot.command(np.tile([0.0, reach], (sim.num_envs, 1)))
            sim.step(1000)
            expected = np.full(sim.num_envs, gap if collides else reach)
            what = f"way of a ball toward another link of a robot with self_collision={collides} [m]"
            expect_close(expected, robot.joint_positions[:, 1], 0.03, what)


def _standing_rover(
    subject: SimulatorUnderTest, **scene: Any
) -> AbstractContextManager[tuple[Simulation, RobotHandle]]:
    pose = Pose(pos=(0.0, 0.0, 0.05))
    return subject.build(ROVER, pose=pose, mode=CommandMode.VELOCITY, num_threads=1, **scene)
