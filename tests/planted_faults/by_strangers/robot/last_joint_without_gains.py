"""The last joint has no gains, so that it is limp."""

from __future__ import annotations

from dataclasses import replace

from frobs_core.description import DriveGains
from frobs_robots_franka.panda_arm import PANDA_ARM

_STIFFNESS = (4000.0, 4000.0, 3000.0, 4000.0, 200.0, 200.0, 40.0)
_DAMPING = (250.0, 250.0, 140.0, 135.0, 7.8, 7.0, 1.0)

FAULTY = replace(
    PANDA_ARM,
    gains=DriveGains(
        stiffness={f"panda_joint{i}": _STIFFNESS[i - 1] for i in range(1, 7)},
        damping={f"panda_joint{i}": _DAMPING[i - 1] for i in range(1, 7)},
    ),
)
