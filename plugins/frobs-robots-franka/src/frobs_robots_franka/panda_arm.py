"""The Franka Emika Panda without a hand."""

from __future__ import annotations

import math

from frobs_core.interfaces import Robot

PANDA_ARM = Robot(
    model="frobs_robots_franka:models/panda_arm.urdf.xacro",
    name="panda_arm",
    # The tool points down, 0.31 m in front of the base; it is screwed on so that its x axis points away from the base.
    home={
        "panda_joint2": -math.pi / 4,
        "panda_joint4": -3 * math.pi / 4,
        "panda_joint6": math.pi / 2,
        "panda_joint7": math.pi / 4,
    },
    tcp="panda_tool0",
)
