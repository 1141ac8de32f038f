"""Description of the Kobuki with a lidar. The dimensions, masses and lidar are those of the FRobs_RL model.

The wheels follow velocity commands. With Kd = 0.05 N·m·s/rad, the wheels reach a new speed within 30 ms (the robot's
mass of 2.4 kg is equivalent to m·r²/2 = 1.5e-3 kg·m² at one wheel). This response is fast compared with the
acceleration limit, but slow enough that the tires do not slip. The drive in FRobs_RL accelerated the wheel rims at 1
m/s². The linear acceleration limit is therefore 1 m/s², and the angular acceleration limit is 2 · 1 m/s² / separation.
"""

from __future__ import annotations

from frobs_core.description import Bumper, Camera, DifferentialDrive, DriveGains, Lidar, Robot

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
        max_linear_velocity=0.7,  # limit of the real Kobuki
        max_angular_velocity=1.9,  # [rad/s] specified measuring range of the Kobuki's gyroscope
        max_linear_acceleration=1.0,
        max_angular_acceleration=2.0 * 1.0 / _SEPARATION,
    ),
    sensors={
        "lidar": Lidar(frame="lidar_link", rays=8, range_min=0.1, range_max=30.0),
        "bumper": Bumper(frame="base_link"),  # covers all directions; the real Kobuki's bumper is at the front
    },
    friction={"caster_front_link": 0.0, "caster_back_link": 0.0},
    cameras={"front": Camera(pos=(0.12, 0.0, 0.16), target=(1.0, 0.0, 0.05), fov_y=60.0, frame="base_link")},
)
