"""Compares each simulator's forward kinematics at random joint positions with the model file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_difference, quat_multiply, quat_rotate
from frobs_devkit.parity.result import Comparison, Line, Measurement, error_panel, judge, skip, worst
from frobs_devkit.parity.tolerances import TOLERANCES
from frobs_devkit.parity.under_test import Subject

POSES = 20
FILE = "model file"
"""Name of the reference. In this measurement, the reference is the model file instead of a simulator."""

_UNLIMITED = np.pi  # [rad or m] range on both sides of 0 for joints without limits


def forward_kinematics(subjects: Sequence[Subject], poses: int = POSES, seed: int = 0) -> Measurement:
    """Compare the poses of all links with the model file at random joint vectors, given and written as joint states."""
    placement = subjects[0].placement
    model, links = placement.model, [link.name for link in placement.model.links]
    limits = np.array([(j.limits.lower, j.limits.upper) for j in model.actuated_joints]).reshape(-1, 2)
    lower, upper = limits.clip(-_UNLIMITED, _UNLIMITED).T
    vectors = np.random.default_rng(seed).uniform(lower, np.maximum(lower, upper), (poses, len(lower)))  # (poses, dof)
    base_pos, base_quat = np.array(placement.pose.pos), np.array(placement.pose.quat_wxyz)
    expected = []
    for link in links:
        pos, quat = model.frame_pose(link, vectors)
        expected.append((base_pos + quat_rotate(base_quat, pos), quat_multiply(base_quat, quat)))

    comparisons: list[Comparison] = []
    distances: list[Line] = []
    numbers = np.arange(1.0, poses + 1.0)
    for i, subject in enumerate(subjects):
        with subject.simulate(subject.alone()) as (_, robot):
            by_method = {"joint vectors given": [robot.frame_pose(link, vectors) for link in links]}
            if subject.level("teleport"):
                by_method["joint states written"] = _written(robot, links, vectors)
            else:
                reason = "the simulator cannot write joint states"
                comparisons.append(skip(subject.label, FILE, reason, "joint states written"))
        judged: dict[str, list[Comparison]] = {"frame_position": [], "frame_orientation": []}
        for how, poses_found in by_method.items():
            pairs = list(zip(expected, poses_found, strict=True))
            off = np.linalg.norm([e[0] - f[0] for e, f in pairs], axis=-1)  # (links, poses)
            turned = np.linalg.norm([quat_difference(e[1], f[1]) for e, f in pairs], axis=-1)
            for name, errors in (("frame_position", off), ("frame_orientation", turned)):
                link = links[int(np.argmax(np.nan_to_num(errors, nan=np.inf).max(axis=1)))]
                what, where = f"link {name.removeprefix('frame_')}s", f"{link}, {how}"
                judged[name].append(judge(name, what, subject.label, FILE, errors, exact=True, where=where))
            distances.append(Line(f"{subject.label}, {how}", numbers, off.max(axis=0), len(distances), i, points=True))
        comparisons += [worst(rows) for rows in judged.values()]
    title = "Largest distance of a link from its position according to the model file"
    return Measurement(
        summary=f"The poses of all {len(links)} links are compared with the model file at {poses} random joint vectors "
        "within the limits. Each simulator provides the poses twice: computed from the joint vectors, and reported after "
        "the joint states are set.",
        comparisons=tuple(comparisons),
        panels=(error_panel(title, distances, "m", TOLERANCES["frame_position"].exact, "joint vector"),),
    )


def _written(robot: RobotHandle, links: Sequence[str], vectors: Floats) -> list[tuple[Floats, Floats]]:
    """Return each link's positions (poses, 3) and orientations (poses, 4), read after writing each joint vector."""
    by_link: list[list[tuple[Floats, Floats]]] = [[] for _ in links]
    for vector in vectors:
        robot.write_joint_state(vector[None])
        for poses, link in zip(by_link, links, strict=True):
            pos, quat = robot.frame_pose(link)
            poses.append((pos[0].copy(), quat[0].copy()))
    return [(np.array([p for p, _ in poses]), np.array([q for _, q in poses])) for poses in by_link]
