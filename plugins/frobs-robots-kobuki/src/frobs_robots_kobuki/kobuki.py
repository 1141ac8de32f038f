"""The Kobuki with a lidar, with the dimensions, the masses and the lidar of FRobs_RL's model.

The wheels follow velocities: with Kd = 0.05 N·m·s/rad they follow a change of speed within 30 ms (the robot's mass of
2.4 kg is equivalent to m·r²/2 = 1.5e-3 kg·m² at one wheel), which is fast compared to the acceleration limit, and slow
enough for the tires not to slip. FRobs_RL's drive accelerated the rims of the wheels by 1 m/s², which is therefore the
linear limit; the angular limit is 2 · 1 m/s² / separation.
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
        max_linear_velocity=0.7,  # the Kobuki's own limit
        max_angular_velocity=1.9,  # [rad/s] specified range of its gyroscope
        max_linear_acceleration=1.0,
        max_angular_acceleration=2.0 * 1.0 / _SEPARATION,
    ),
    sensors={
        "lidar": Lidar(frame="lidar_link", rays=8, range_min=0.1, range_max=30.0),
        "bumper": Bumper(frame="base_link"),  # in all directions; the Kobuki's own is at the front
    },
    friction={"caster_front_link": 0.0, "caster_back_link": 0.0},
)
