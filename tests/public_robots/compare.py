"""A robot as its file says it, and as it was built: every difference, and whether the model's notes tell of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from engines import ENGINES, Pybullet, build, matrix
from original import MOVING, Original, OriginalJoint

from frobs_core.models import JointType, RobotModel, load_model
from frobs_core.util.errors import ModelFileError

TOLERANCE = 1e-6
POSES = 20

EXPLAINS = {
    "mass": {"no-mass", "zero-mass"},
    "centre of mass": {"zero-mass"},
    "inertia": {"no-mass", "zero-mass", "no-inertia", "impossible-inertia", "thin-inertia"},
    "collision box": {"empty-shape"},
    "type": {"no-range", "free-root"},
    "range": {"no-range", "continuous-range"},
    "velocity limit": {"no-cap", "no-range"},
    "effort limit": {"no-cap", "no-range"},
}
"""Which rules of the notes account for a difference of a quantity; no other can differ."""


@dataclass(frozen=True)
class Difference:
    """One quantity that is not what the file says."""

    element: str
    quantity: str
    size: float
    told: bool


@dataclass
class Result:
    """What became of one file on one simulator."""

    file: Path
    model: RobotModel | None = None
    refused: str = ""
    differences: list[Difference] = field(default_factory=list)
    kinematics: float = math.nan
    kinematics_note: str = ""

    @property
    def untold(self) -> list[Difference]:
        return [difference for difference in self.differences if not difference.told]


def compare(file: Path, simulator: str) -> Result:
    """Build a file's robot on a simulator and compare it with the file."""
    result = Result(file)
    try:
        model = load_model(file)
        simulation = build(simulator, model, POSES)
    except ModelFileError as error:
        result.refused = error.reason
        return result
    result.model = model
    original = Original(file)
    with simulation_closed(simulation):
        handle = simulation.robots["robot"]
        found = [*_limits(original, handle)]
        if simulator in ENGINES:
            found += _engine(original, model, ENGINES[simulator](simulation))
        result.differences = [_explained(model, *difference) for difference in found]
        try:
            result.kinematics = _kinematics(original, handle)
        except ValueError as error:
            result.kinematics_note = f"Pinocchio: {str(error).splitlines()[0]}"
    return result


class simulation_closed:  # noqa: N801 - a context manager, used like a function
    def __init__(self, simulation) -> None:
        self._simulation = simulation

    def __enter__(self):
        return self._simulation

    def __exit__(self, *_) -> None:
        self._simulation.close()


def _explained(model: RobotModel, element: str, quantity: str, size: float) -> Difference:
    told = any(note.element == element and note.rule in EXPLAINS.get(quantity, ()) for note in model.notes)
    return Difference(element, quantity, size, told)


def _limits(original: Original, handle) -> Iterator[tuple[str, str, float]]:
    """Yield where what the handle says of its joints is not what the file says."""
    names = [joint.name for joint in original.joints.values() if joint.type in MOVING and joint.mimic is None]
    if list(handle.joint_names) != names:
        yield "<robot>", "joint names", math.inf
        return
    for i, name in enumerate(names):
        joint = original.joints[name]
        element = f'<joint name="{name}">'
        limits = {
            key: values[0, i] for key, values in (("velocity", handle.velocity_limit), ("effort", handle.effort_limit))
        }
        for key, value in limits.items():
            said = joint.limits[key]
            if joint.type == "continuous" and math.isnan(said):
                said = math.inf  # a continuous joint need not give any
            if (size := _apart(said, value)) > TOLERANCE:
                yield element, f"{key} limit", size
        yield from _range(joint, element, (handle.position_lower[0, i], handle.position_upper[0, i]))


def _range(joint: OriginalJoint, element: str, found: tuple[float, float]) -> Iterator[tuple[str, str, float]]:
    said = (joint.limits["lower"], joint.limits["upper"])
    if joint.type == "continuous" and (math.isnan(said[0]) or said[0] >= said[1]):
        said = (-math.inf, math.inf)
    elif joint.type != "continuous":
        said = tuple(0.0 if math.isnan(bound) else bound for bound in said)
    size = max(map(_apart, said, found))
    if size > TOLERANCE:
        yield element, "range", size


def _apart(first: float, second: float) -> float:
    if first == second:
        return 0.0
    return abs(first - second) if math.isfinite(first) and math.isfinite(second) else math.inf


def _engine(original: Original, model: RobotModel, engine) -> Iterator[tuple[str, str, float]]:
    """Yield where what the engine has compiled is not what the file says."""
    kinds = {joint.name: joint.type for joint in model.joints}
    for name, link in original.links.items():
        built, element = engine.link(name), f'<link name="{name}">'
        if (size := abs(built.mass - link.mass)) > TOLERANCE * max(1e-3, link.mass):
            yield element, "mass", size  # never where the engine does not tell, which is NaN
        if link.mass and (size := np.abs(built.centre - link.centre).max()) > TOLERANCE:
            yield element, "centre of mass", size
        scale = np.abs(link.inertia).max()
        if (size := np.abs(built.inertia - link.inertia).max()) > TOLERANCE * max(1e-9, scale):
            yield element, "inertia", size
        apart = _boxes_apart if engine.box_is_exact else _box_beyond
        if (size := apart(built.box, link.box)) > TOLERANCE:
            yield element, "collision box", size
    for name, joint in original.joints.items():
        element = f'<joint name="{name}">'
        if kinds[name] != JointType(joint.type):
            yield element, "type", math.inf
        if joint.type in MOVING:
            built = engine.joint(name)
            if built.type != ("prismatic" if joint.type == "prismatic" else "revolute"):
                yield element, "engine's type", math.inf
            if (size := np.abs(built.axis - joint.axis).max()) > TOLERANCE:
                yield element, "axis", size
            yield from _range(joint, element, built.range)
    said = {joint.name: joint.mimic for joint in original.joints.values() if joint.mimic and joint.type in MOVING}
    found = engine.mimics()
    for name in () if isinstance(engine, Pybullet) else said.keys() | found.keys():
        leader, multiplier, offset = said.get(name) or ("", 0.0, 0.0)
        other, other_multiplier, other_offset = found.get(name) or ("", 0.0, 0.0)
        size = max(abs(multiplier - other_multiplier), abs(offset - other_offset))
        if leader != other or size > TOLERANCE:
            yield f'<joint name="{name}">', "mimic", size


def _boxes_apart(first, second) -> float:
    if first is None or second is None:
        return 0.0 if first is second else math.inf
    return float(max(np.abs(first[0] - second[0]).max(), np.abs(first[1] - second[1]).max()))


def _box_beyond(built, said) -> float:
    """Return how far a box is from holding another, or from being no more than twice its diagonal beyond it."""
    if built is None or said is None:
        return 0.0 if built is said else math.inf
    missing = max((built[0] - said[0]).max(), (said[1] - built[1]).max()) - 2e-3  # hulls lose small corners
    beyond = max((said[0] - built[0]).max(), (built[1] - said[1]).max())
    return float(max(0.0, missing, beyond - 2 * np.linalg.norm(said[1] - said[0]) - 0.01))


def _kinematics(original: Original, handle) -> float:
    """Return how far links are from where Pinocchio has them, at most: [m] and in elements of the rotation matrix.

    Both what the engine says after its state was written, and what it says for given joint positions.
    """
    rng = np.random.default_rng(0)
    low = np.maximum(handle.position_lower[0], -np.pi)
    high = np.minimum(handle.position_upper[0], np.pi)
    positions = rng.uniform(np.minimum(low, high), high, (POSES, handle.dof))
    expected = original.forward_kinematics(dict(zip(handle.joint_names, positions.T, strict=True)))
    handle.write_joint_state(positions)
    worst = 0.0
    for link, poses in expected.items():
        for pos, quat in (handle.frame_pose(link), handle.frame_pose(link, positions)):
            worst = max(
                worst, float(np.abs(pos - poses[:, :3, 3]).max()), float(np.abs(matrix(quat) - poses[:, :3, :3]).max())
            )
    return worst
