"""Description of the Franka Emika Panda without a hand."""

from __future__ import annotations

import math

from frobs_core.description import Camera, DriveGains, Robot

_STIFFNESS = (4000.0, 4000.0, 3000.0, 4000.0, 200.0, 200.0, 40.0)  # [N·m/rad]
_DAMPING = (
    250.0,
    250.0,
    140.0,
    135.0,
    7.8,
    7.0,
    1.0,
)  # [N·m·s/rad] critical damping for the largest inertia, which includes the hand


def _by_joint(numbers: tuple[float, ...]) -> dict[str, float]:
    return {f"panda_joint{i}": number for i, number in enumerate(numbers, start=1)}


PANDA_ARM = Robot(
    model="frobs_robots_franka:models/panda_arm.urdf.xacro",
    name="panda_arm",
    # The tool points down, 0.31 m in front of the base, and is mounted so that its x axis points away from the base.
    home={
        "panda_joint2": -math.pi / 4,
        "panda_joint4": -3 * math.pi / 4,
        "panda_joint6": math.pi / 2,
        "panda_joint7": math.pi / 4,
    },
    tcp="panda_tool0",
    gains=DriveGains(stiffness=_by_joint(_STIFFNESS), damping=_by_joint(_DAMPING)),
    cameras={"wrist": Camera(pos=(-0.09, 0.0, -0.02), target=(0.0, 0.0, 0.3), fov_y=60.0, frame="panda_tool0")},
)
