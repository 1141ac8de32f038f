"""Properties of the robot that its model file does not define. Limits, masses and shapes are read from the file."""

from __future__ import annotations

from pathlib import Path

from frobs_core.description import DifferentialDrive, DriveGains, Robot

MY_ROVER = Robot(
    model=str(Path(__file__).with_name("my_rover.urdf.xacro")),
    name="my_rover",
    base="wheeled",  # the base moves freely in the world
    tcp="base_link",  # Tasks use this link as the tool center point.
    # Wheels follow a velocity, not a position. With much more damping, the tires slip or oscillate at larger timesteps.
    gains=DriveGains(stiffness=0.0, damping=0.2),
    differential_drive=DifferentialDrive(
        left=("left_wheel_joint",),
        right=("right_wheel_joint",),
        separation=0.3,  # [m]
        wheel_radius=0.06,  # [m]
        max_linear_velocity=0.8,  # [m/s] for an action of 1
        max_angular_velocity=2.5,  # [rad/s]
    ),
    friction={"front_foot": 0.0, "back_foot": 0.0},  # The feet slide without friction.
    # sensors={"scan": Lidar(frame="base_link", …)},  # a lidar; tasks read it with frobs_core.sensing.sensors.Sensors
)

if __name__ == "__main__":  # python my_rover.py checks the robot
    from frobs_devkit.testing import check_robot, run_checks

    for result in run_checks(check_robot(MY_ROVER)).results:
        print(result.status, result.name, result.message)
