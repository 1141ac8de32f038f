"""Which links of a robot are in each other."""

from __future__ import annotations

import mujoco

from frobs_core.arrays import Floats
from frobs_core.interfaces import Overlap


def find_overlaps(model: mujoco.MjModel, state: Floats, prefix: str) -> list[Overlap]:
    """Return the pairs of bodies that are in each other, the deepest first.

    Args:
        model: The compiled model.
        state: (n,) one environment's row of the batch.
        prefix: What the names of the robot's bodies begin with: ``"robot/"``.
    """
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_fwdPosition(model, data)
    depths: dict[tuple[str, str], float] = {}
    for contact in data.contact:
        names = [model.body(model.geom_bodyid[geom]).name for geom in (contact.geom1, contact.geom2)]
        if contact.dist < 0.0 and all(name.startswith(prefix) for name in names):
            first, second = (name.removeprefix(prefix) for name in names)
            depths[first, second] = max(-float(contact.dist), depths.get((first, second), 0.0))
    found = [Overlap(first=first, second=second, depth=depth) for (first, second), depth in depths.items()]
    return sorted(found, key=lambda overlap: -overlap.depth)
