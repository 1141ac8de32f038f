"""Description of the SO-101 with its gripper.

The gripper's numbers are those that ``frobs doctor robot`` finds in the model file. With the inertia of the motors, the
drives are critically damped at 10 Hz for the largest inertia that each joint moves. The limits of their effort are
reached at errors of 15 to 30 mrad, as on the real servos, whose stiffness is about 1000 N·m/rad.
"""

from __future__ import annotations

from frobs_core.description import Camera, DriveGains, EndEffector, Robot

_ARM = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
_JOINTS = (*_ARM, "gripper")
_STIFFNESS = (226.0, 205.0, 144.0, 114.0, 111.0, 111.0)  # [N·m/rad]
_DAMPING = (7.21, 6.54, 4.6, 3.65, 3.53, 3.53)  # [N·m·s/rad]
_OPEN, _CLOSED = {"gripper": 0.88}, {"gripper": -0.174533}  # [rad] a wider jaw would be behind the palm

SO101 = Robot(
    model="frobs_robots_so101:models/so101.urdf.xacro",
    name="so101",
    home=_OPEN,  # The arm is in the middle of its calibrated range: bent by 90 degrees, the tool points forward.
    tcp="tcp",
    gains=DriveGains(
        stiffness=dict(zip(_JOINTS, _STIFFNESS, strict=True)), damping=dict(zip(_JOINTS, _DAMPING, strict=True))
    ),
    friction={"gripper_link": 1.2, "moving_jaw_so101_v1_link": 1.2},
    armature=dict.fromkeys(_JOINTS, 0.028),  # [kg·m²] from the maker's MuJoCo file
    groups={"arm": _ARM, "gripper": ("gripper",)},
    default_controllers={"gripper": "gripper_delta"},
    end_effectors={
        "gripper": EndEffector(
            tcp="tcp",
            arm="arm",
            group="gripper",
            open=_OPEN,
            closed=_CLOSED,
            gap=(0.0018, 0.0592),
            has_fixed_jaw=True,
        )
    },
    cameras={"wrist": Camera(pos=(0.055, 0.0, -0.07), target=(0.0, 0.0, 0.04), fov_y=85.0, frame="tcp")},
)
