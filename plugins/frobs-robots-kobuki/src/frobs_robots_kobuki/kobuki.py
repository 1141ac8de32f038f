"""The Kobuki with a lidar, with the dimensions, the masses and the lidar of FRobs_RL's model.

The wheels follow velocities: with Kd = 0.05 N·m·s/rad a change of speed is followed within 30 ms (the robot's mass of
2.4 kg, seen from one wheel, is m·r²/2 = 1.5e-3 kg·m²), which is quick beside the acceleration limit and gentle enough
for the tyres not to slip. FRobs_RL's drive let the rims of the wheels accelerate by 1 m/s²; so that is the limit ahead,
and 2 · 1 m/s² / separation the limit in turning.
"""

from __future__ import annotations

from frobs_core.interfaces import Bumper, DifferentialDrive, DriveGains, Lidar, Robot

_SEPARATION = 0.23  # [m]

KOBUKI = Robot(
    model="frobs_robots_kobuki:models/kobuki.urdf.xacro",
    name="kobuki",
    base="wheeled",
    tcp="base_link",
    gains=DriveGains(stiffness=0.0, damping=0.05),
    differential_drive=DifferentialDrive(
        left=("wheel_left_joint",),
        right=("wheel_right_joint",),
        separation=_SEPARATION,
        wheel_radius=0.035,
        max_linear_velocity=0.7,  # the Kobuki's own
        max_angular_velocity=1.9,  # [rad/s] up to which its gyroscope is specified
        max_linear_acceleration=1.0,
        max_angular_acceleration=2.0 * 1.0 / _SEPARATION,
    ),
    sensors={
        "lidar": Lidar(frame="lidar_link", rays=8, range_min=0.1, range_max=30.0),
        "bumper": Bumper(frame="base_link"),  # all around, where the Kobuki's own is at the front
    },
    friction={"caster_front_link": 0.0, "caster_back_link": 0.0},
)
