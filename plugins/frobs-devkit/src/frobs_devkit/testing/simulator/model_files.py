"""Checks of how a simulator translates robot model files and reports the translation."""

from __future__ import annotations

import multiprocessing
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.description import Placement, Scene
from frobs_core.models import Collision, Mesh, Treatment
from frobs_core.util.errors import ModelFileError, UnknownNameError
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, expect, expect_raises
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.simulator.robots import ARM, GRIPPER, LIFT, PILE, PILE_DEPTH, ROVER, model_of
from frobs_devkit.testing.simulator.under_test import TIMESTEP, WEIGHTLESS, SimulatorUnderTest, verifies
from frobs_models import elements

_BROKEN = {"cut_off.stl": bytes(80) + b"\xff\xff\xff\x00" + bytes(500), "no_numbers.obj": b"v 0 0\nf 1 2 3\n"}


def elements_are_accounted_for(subject: SimulatorUnderTest) -> None:
    """``translation`` lists each kind of model element, and describes how an element is approximated or dropped."""
    cls = subject.record.load()
    for robot in (ARM, LIFT, ROVER, GRIPPER, PILE):
        model = model_of(robot.model)
        rows = cls.translation(model)
        if not rows:
            raise Inconclusive(
                "translation() returns an empty result, so 'frobs doctor robot' shows every element as unknown"
            )
        missing = set(elements(model)) - {row.element for row in rows}
        expect(not missing, f"the result of translation() of {robot.name} has no row for {', '.join(sorted(missing))}.")
        for row in rows:
            silent = row.treatment is not Treatment.KEPT and not row.how
            expect(not silent, f"translation() does not describe how '{row.element}' is {row.treatment.value}.")


@verifies("teleport")
def mimics_follow(subject: SimulatorUnderTest) -> None:
    """A mimic joint follows its leading joint after a reset, after its position is written, and during motion."""
    with subject.build(GRIPPER) as (sim, robot):
        n = sim.num_envs
        for positions in (np.zeros((n, 1)), np.linspace(-0.4, 0.4, n)[:, None]):
            robot.write_joint_state(positions)
            _expect_followed(robot, 1e-9, "of a placed gripper")
        robot.command(np.full((n, 1), 0.3))
        for _ in range(40):
            sim.step(5)
            _expect_followed(robot, 0.05, "of a moving gripper")
        _expect_followed(robot, 0.005, "of a holding gripper")


def _expect_followed(robot: RobotHandle, tolerance: float, which: str) -> None:
    angle = {}
    for link in ("finger", "follower"):
        quat = robot.frame_pose(link)[1]
        angle[link] = 2.0 * np.arctan2(quat[:, 2], quat[:, 0])  # about y
    expected = -2.0 * angle["finger"] + 0.1
    expect_close(expected, angle["follower"], tolerance, f"angle of the follower {which} [rad]")


def overlaps_are_told(subject: SimulatorUnderTest) -> None:
    """``overlaps`` reports all overlapping links that are not neighbors, with the depth of the overlap."""
    with subject.build(PILE, num_envs=1) as (sim, _):
        overlaps = sim.overlaps()
        if overlaps is None:
            raise NotApplicable("the simulator does not report overlaps")
        expect(
            [{overlap.first, overlap.second} for overlap in overlaps] == [{"a", "c"}],
            f"overlaps() returns {overlaps}; of three balls in a row, 'a' and 'c' overlap, and the others are neighbors.",
        )
        expect_close(PILE_DEPTH, overlaps[0].depth, 1e-4, "depth of the overlap of two balls [m]")
        with expect_raises(UnknownNameError, "overlaps('no_such_robot')"):
            sim.overlaps("no_such_robot")


def overlapping_links_let_each_other_be(subject: SimulatorUnderTest) -> None:
    """Links that overlap at home do not push each other apart."""
    with subject.build(PILE, gravity=WEIGHTLESS, floor=False) as (sim, robot):
        sim.step(100)
        expect_close(
            robot.home, robot.joint_positions, 1e-3, "joint positions 0.2 s after a start with overlapping links"
        )


@verifies("contacts")
def broken_meshes_are_refused(subject: SimulatorUnderTest) -> None:
    """A broken mesh raises a ModelFileError with the file name, and leaves no processes or temporary files behind."""
    model = model_of(ARM.model)
    first, *others = model.links
    for (name, content), num_envs in zip(_BROKEN.items(), (subject.num_envs, 1), strict=True):
        with _folder_for_temporary_files() as folder, tempfile.TemporaryDirectory() as place:
            path = Path(place) / name
            path.write_bytes(content)
            link = replace(first, collisions=(Collision(Mesh(path)),))
            broken = replace(model, links=(link, *others))
            placement = Placement(robot=ARM, model=broken, command_mode=CommandMode.POSITION)
            before = {child.pid for child in multiprocessing.active_children()}
            with expect_raises(ModelFileError, f"a robot with the broken mesh '{name}'", naming=name):
                subject.record.load()({"robot": placement}, Scene(), num_envs=num_envs, physics_timestep=TIMESTEP)
            left = [child.name for child in multiprocessing.active_children() if child.pid not in before]
            left += [entry.name for entry in folder.iterdir() if entry != Path(place)]
            expect(not left, f"after '{name}' was rejected, these remain: {', '.join(left)}.")


@contextmanager
def _folder_for_temporary_files() -> Iterator[Path]:
    kept, variable = tempfile.tempdir, os.environ.get("TMPDIR")
    with tempfile.TemporaryDirectory() as folder:
        tempfile.tempdir = os.environ["TMPDIR"] = folder
        try:
            yield Path(folder)
        finally:
            tempfile.tempdir = kept
            if variable is None:
                del os.environ["TMPDIR"]
            else:
                os.environ["TMPDIR"] = variable
