"""The ABB IRB 120."""
from frobs_core.interfaces import Robot

IRB120 = Robot(
    model="frobs_robots_abb:models/irb120.urdf.xacro",
    name="irb120",
    home={"joint_2": 0.2, "joint_3": 0.2, "joint_5": 1.1708},
    tcp="tool0",
)
