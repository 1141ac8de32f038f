"""Description of a parallel gripper with the dimensions of the Robotiq 2F-85."""

from __future__ import annotations

from frobs_core.interfaces import DriveGains, EndEffector, Robot

PARALLEL_GRIPPER = Robot(
    model="frobs_grippers:models/parallel_gripper.urdf.xacro",
    name="parallel_gripper",
    home={"finger_joint": 0.0425},
    tcp="tcp",
    # The gains overdamp the two fingers, whose combined mass is 0.3 kg. If an object stops the pads 1 cm before
    # the commanded position, each pad presses with 50 N. A pad never presses with more than half of the effort limit.
    gains=DriveGains(stiffness=10_000.0, damping=120.0),
    friction={"left_finger": 1.2, "right_finger": 1.2},
    default_controllers={"all": "gripper_delta"},
    end_effectors={"fingers": EndEffector(tcp="tcp", open={"finger_joint": 0.0425}, closed={"finger_joint": 0.0})},
)
