"""Checks of contacts that robots have a part in."""

from __future__ import annotations

import numpy as np

from frobs_core.interfaces import Body, CommandMode, Contact
from frobs_core.models import Box, Pose
from frobs_devkit.testing.checks import Outcome, expect
from frobs_devkit.testing.simulator.robots import ROVER
from frobs_devkit.testing.simulator.subject import BALL, SimulatorUnderTest, verifies

_STANDING = Pose(pos=(0.0, 0.0, 0.05))
_KERB = Body(geometry=Box((0.2, 0.02, 0.2)), pose=Pose(pos=(0.0, 0.129, 0.1)))  # 1 mm deep in the rover's left wheel


@verifies("contacts")
def contacts_of_robots_are_told(subject: SimulatorUnderTest) -> Outcome:
    """A contact's side can be a robot, one of its links, or anything; the links are told apart."""
    contacts = {
        "left": Contact(first="robot/left_wheel", second="floor"),
        "robot": Contact(first="robot"),
        "pair": Contact(first="robot/left_wheel", second="ball"),
    }
    with subject.build(
        ROVER, pose=_STANDING, mode=CommandMode.VELOCITY, bodies={"ball": BALL}, contacts=contacts, num_threads=1
    ) as (
        sim,
        _,
    ):
        sim.step(20)
        for name, wanted in (("left", True), ("robot", True), ("pair", False)):
            told = sim.contact(name)
            expect((told == wanted).all(), f"contact('{name}') of a rover that stands on the floor is {told}.")
    return None


@verifies("contacts")
def contacts_can_ignore(subject: SimulatorUnderTest) -> Outcome:
    """A contact with anything leaves out what it ignores: the floor, a body, a robot; and nothing else."""
    contacts = {
        "anything": Contact(first="robot/left_wheel"),
        "but the floor": Contact(first="robot/left_wheel", ignore=("floor",)),
        "but floor and kerb": Contact(first="robot/left_wheel", ignore=("floor", "kerb")),
        "but the robot": Contact(first="floor", ignore=("kerb", "robot")),
        "right wheel": Contact(first="robot/right_wheel", ignore=("floor",)),
    }
    with subject.build(
        ROVER, pose=_STANDING, mode=CommandMode.VELOCITY, bodies={"kerb": _KERB}, contacts=contacts, num_threads=1
    ) as (sim, _):
        sim.step(2)
        wanted = (True, True, False, False, False)
        for (name, contact), expected in zip(contacts.items(), wanted, strict=True):
            told = sim.contact(name)
            what = f"of '{contact.first}' that ignores {', '.join(contact.ignore) or 'nothing'}"
            expect((told == expected).all(), f"a contact {what} is {told}, not {expected}.")
    return None


@verifies("contacts")
def contacts_end_with_a_reset(subject: SimulatorUnderTest) -> Outcome:
    """After a reset no contact is told, of the environments of the mask only, until the next step."""
    contacts = {"standing": Contact(first="robot/left_wheel", second="floor")}
    with subject.build(ROVER, pose=_STANDING, mode=CommandMode.VELOCITY, contacts=contacts, num_threads=1) as (sim, _):
        sim.step(20)
        expect(sim.contact("standing").all(), "no contact is told of a rover that stands on the floor.")
        mask = np.arange(sim.num_envs) == 0
        sim.reset(mask)
        told = sim.contact("standing")
        expect(not told[0], "the contact of the last episode is told after a reset.")
        expect(told[1:].all(), f"the reset of environment 0 ended contacts of others: {told}.")
        expect(
            not sim.contact_force("standing")[0].any(), "the force of the last episode's contact is told after a reset."
        )
        sim.step(20)
        expect(sim.contact("standing").all(), "no contact is told in the step after a reset.")
    return None
