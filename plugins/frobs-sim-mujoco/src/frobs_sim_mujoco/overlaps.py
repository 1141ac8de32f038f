"""Detection of overlapping links."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import mujoco

from frobs_core.description import Overlap, Placement
from frobs_core.models import home_positions
from frobs_core.util.arrays import Floats


def find_overlaps(model: mujoco.MjModel, state: Floats, prefix: str) -> list[Overlap]:
    """Return a robot's overlapping body pairs, deepest first.

    Args:
        model: The compiled model.
        state: One environment's row of the batch's states, (n,).
        prefix: Prefix of the robot's body names, such as ``"robot/"``.
    """
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    depths: dict[tuple[str, str], float] = {}
    for first, second, depth in _touching(model, data):
        if first.startswith(prefix) and second.startswith(prefix):
            pair = first.removeprefix(prefix), second.removeprefix(prefix)
            depths[pair] = max(depth, depths.get(pair, 0.0))
    overlaps = [Overlap(first=first, second=second, depth=depth) for (first, second), depth in depths.items()]
    return sorted(overlaps, key=lambda overlap: -overlap.depth)


def overlaps_at_home(model: mujoco.MjModel, robots: Mapping[str, Placement]) -> list[tuple[str, str]]:
    """Return the MuJoCo names of all pairs of bodies that overlap within a robot at the home position."""
    data = mujoco.MjData(model)
    for name, placement in robots.items():
        robot = placement.model
        home = dict(zip(robot.joint_names, home_positions(robot, placement.robot.home).tolist(), strict=True))
        for joint in robot.joints:
            if joint.mimic is not None:
                home[joint.name] = joint.mimic.multiplier * home[joint.mimic.joint] + joint.mimic.offset
        for joint_name, position in home.items():
            data.qpos[model.joint(f"{name}/{joint_name}").qposadr[0]] = position
    pairs = {
        (first, second): None
        for first, second, _ in _touching(model, data)
        if first.partition("/")[0] == second.partition("/")[0] in robots
    }
    return list(pairs)


def _touching(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[tuple[str, str, float]]:
    """Yield the two body names and the penetration depth [m] of each contact between overlapping bodies."""
    mujoco.mj_fwdPosition(model, data)
    for contact in data.contact:
        if contact.dist < 0.0:
            first, second = (model.body(model.geom_bodyid[geom]).name for geom in (contact.geom1, contact.geom2))
            yield first, second, -float(contact.dist)
