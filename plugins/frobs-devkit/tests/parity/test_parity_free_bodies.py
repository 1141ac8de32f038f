"""Sliding distance, fall and slip force of the bodies of a task: with planted differences, and on real engines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from frobs_core.description import Body
from frobs_core.models import Box, Pose
from frobs_core.util.rotations import matrix_from_quat
from frobs_devkit.parity import Measurement, Status, Subject, body_experiments, measure_parity
from frobs_devkit.parity.body_experiments import fall, slide, sliding
from frobs_devkit.parity.free_bodies import Bounded, bodies_of
from frobs_devkit.parity.slip import gripper_of, pull, slip

Compare = Callable[..., Sequence[Subject]]
LIFT = "frobs/PandaLift-v0"
MEASUREMENTS: dict[str, Callable[[Sequence[Subject]], Measurement]] = {"sliding": sliding, "fall": fall, "slip": slip}
WEIGHT = 0.1 * 9.81  # [N] of the cube


@pytest.mark.parametrize("name", MEASUREMENTS)
def test_an_engine_agrees_with_itself_to_the_last_bit(name: str, subjects: Compare) -> None:
    found = MEASUREMENTS[name](subjects(environment=LIFT))
    assert all(c.error == 0.0 and c.status is Status.PASSED for c in found.comparisons)
    assert found.comparisons
    (panel,) = found.panels
    assert [len(line.x) > 40 and line.x.shape == line.y.shape for line in panel.lines] == [True, True]


@pytest.mark.parametrize(
    ("name", "simulator", "quantity"),
    [
        ("sliding", "slippery", "sliding distance of 'cube'"),
        ("fall", "sunk", "rest height of 'cube'"),
        ("fall", "restless", "time to rest of 'cube'"),
        ("fall", "bouncy", "bounce height of 'cube'"),
        ("slip", "oily", "slip force of 'cube'"),
    ],
)
def test_a_planted_difference_is_found(name: str, simulator: str, quantity: str, subjects: Compare) -> None:
    found = MEASUREMENTS[name](subjects(simulator, LIFT))
    failed = {c.quantity: c for c in found.comparisons if c.status is Status.FAILED}
    assert quantity in failed
    assert "instead of" in failed[quantity].where


@pytest.mark.slow
def test_other_quantities_do_not_depend_on_a_planted_friction(subjects: Compare) -> None:
    assert fall(subjects("slippery", LIFT)).status is Status.PASSED
    assert sliding(subjects("oily", LIFT)).status is Status.PASSED


@pytest.mark.parametrize("name", MEASUREMENTS)
def test_a_task_without_free_bodies_is_skipped(name: str, subjects: Compare) -> None:
    (skipped,) = MEASUREMENTS[name](subjects()).comparisons
    assert skipped.status is Status.SKIPPED
    assert skipped.reason == "the task has no free body"


@pytest.mark.parametrize("mass", [100.0, 400.0])
def test_a_body_that_the_gripper_cannot_hold_is_skipped(mass: float, subjects: Compare) -> None:
    (skipped,) = slip(subjects(environment=LIFT, mass=mass)).comparisons
    assert skipped.status is Status.SKIPPED
    assert "does not hold the body" in skipped.reason


def test_a_robot_without_a_gripper_is_skipped(subjects: Compare) -> None:
    bare = [
        replace(subject, placement=replace(subject.placement, robot=replace(subject.placement.robot, end_effectors={})))
        for subject in subjects(environment=LIFT)
    ]
    (skipped,) = slip(bare).comparisons
    assert (skipped.status, skipped.reason) == (Status.SKIPPED, "the robot has no gripper")


def test_a_body_that_does_not_stop_is_skipped(subjects: Compare, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(body_experiments, "_SLIDING_DURATION", 0.1)
    (skipped,) = sliding(subjects(environment=LIFT)).comparisons
    assert skipped.status is Status.SKIPPED
    assert "does not stop" in skipped.reason


def test_bodies_that_differ_only_in_place_and_color_are_measured_once(subjects: Compare) -> None:
    (subject, _) = subjects(environment="frobs/PandaStack-v0")
    assert list(subject.free_bodies) == ["cube", "base"]
    assert [body.name for body in bodies_of(subject)] == ["cube"]


@pytest.mark.parametrize("size", [(0.1, 0.2, 0.3), (0.3, 0.1, 0.2), (0.2, 0.3, 0.1), (0.3, 0.2, 0.1)])
@pytest.mark.parametrize("shortest", ["y", "z"])
def test_bodies_are_turned_by_their_edges(size: tuple[float, float, float], shortest: Any) -> None:
    body = Bounded("box", Body(geometry=Box(size), mass=1.0, pose=Pose()))
    matrix = matrix_from_quat(body.turned(shortest))
    assert np.abs(matrix @ np.array(size)) == pytest.approx([0.3, 0.1, 0.2] if shortest == "y" else [0.3, 0.2, 0.1])
    assert np.linalg.det(matrix) == pytest.approx(1.0)


@pytest.mark.needs("pybullet")
@pytest.mark.slow
def test_real_engines_follow_coulombs_law(subjects: Compare) -> None:
    tool = gripper_of(subjects("pybullet", LIFT)[0])
    assert tool is not None
    for subject in subjects("pybullet", LIFT):
        (cube,) = bodies_of(subject)
        # Cube and floor have 0.5, and fingers 1.2. On the floor the larger coefficient counts, and between the fingers their own
        # on MuJoCo and the product on PyBullet.
        assert slide(subject, cube).values["sliding_distance"] == pytest.approx(1.0 / (2.0 * 9.81 * 0.5), rel=0.1)
        fingers = 1.2 if subject.simulator == "mujoco" else 0.5 * 1.2
        force = pull(subject, cube, tool).values["slip_force"]
        assert force == pytest.approx((2.0 * 5.0 * fingers - 1.0) * WEIGHT, rel=0.15)


@pytest.mark.needs("pybullet")
@pytest.mark.slow
def test_a_certificate_of_a_manipulation_task_has_all_three(subjects: Compare) -> None:
    found = measure_parity(LIFT, ["mujoco", "pybullet"], only=list(MEASUREMENTS))
    assert [m.name for m in found.measurements] == list(MEASUREMENTS)
    comparisons = [c for m in found.measurements for c in m.comparisons]
    assert [c.quantity for c in comparisons if np.isnan(c.error)] == []
    assert len(comparisons) == 5
    assert found.measurements[1].status is Status.PASSED
