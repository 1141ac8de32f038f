"""The gripper: what its model file does not state."""

from frobs_core.interfaces import DriveGains, EndEffector, Robot

PINCER = Robot(
    model="frobs_tasks_lift_part:pincer.urdf.xacro",
    name="pincer",
    home={"opening": 0.03},
    tcp="tcp",
    gains=DriveGains(stiffness=2_000.0, damping=60.0),
    friction={"left": 1.2, "right": 1.2},
    default_controllers={"all": "gripper_delta"},
    end_effectors={"fingers": EndEffector(tcp="tcp", open={"opening": 0.03}, closed={"opening": 0.0})},
)
