"""Description of a two-finger hand with the dimensions of the Franka hand."""

from __future__ import annotations

from frobs_core.description import Camera, DriveGains, EndEffector, Robot

TWO_FINGER_HAND = Robot(
    model="frobs_grippers:models/two_finger_hand.urdf.xacro",
    name="two_finger_hand",
    home={"finger_joint": 0.04},
    tcp="tcp",
    # The gains critically damp the two fingers and the motor. If an object stops the pads 1 cm before the commanded
    # position, each pad presses with 50 N. A pad never presses with more than half of the effort limit.
    gains=DriveGains(stiffness=10_000.0, damping=300.0),
    # Estimates, because the vendor publishes no value. The fingers alone weigh 0.2 kg. Without the motor's inertia,
    # the drive could accelerate them to almost 3 m/s in a physics step of 4 ms.
    armature={"finger_joint": 1.0, "right_finger_joint": 1.0},
    friction={"left_finger": 1.2, "right_finger": 1.2},
    default_controllers={"all": "gripper_delta"},
    end_effectors={
        "fingers": EndEffector(tcp="tcp", open={"finger_joint": 0.04}, closed={"finger_joint": 0.0}, gap=(0.0, 0.08))
    },
    cameras={"wrist": Camera(pos=(-0.08, 0.0, -0.05), target=(-0.04, 0.0, 0.05), fov_y=85.0, frame="tcp")},
)
