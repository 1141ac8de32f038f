"""Properties of the robot that its model file does not define. Limits, masses and shapes are read from the file."""

from __future__ import annotations

from pathlib import Path

from frobs_core.interfaces import Robot

MY_ARM = Robot(
    model=str(Path(__file__).with_name("my_arm.urdf.xacro")),
    name="my_arm",
    home={"shoulder": 0.0, "elbow": 0.3},  # [rad] initial joint positions of an episode; joints you omit start at 0
    tcp="tool0",  # Tasks use this link as the tool center point.
    # gains=DriveGains(stiffness=…, damping=…),  # by default, each joint is critically damped
)
