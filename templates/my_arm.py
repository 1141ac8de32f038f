"""The robot: a description of what its model file does not say. Limits, masses and shapes are read from that file."""

from __future__ import annotations

from pathlib import Path

from frobs_core.interfaces import Robot

MY_ARM = Robot(
    model=str(Path(__file__).with_name("my_arm.urdf.xacro")),
    name="my_arm",
    home={"shoulder": 0.0, "elbow": 0.3},  # [rad] where episodes begin; a joint that is left out rests at 0
    tcp="tool0",  # the link that tasks talk about
    # gains=DriveGains(stiffness=…, damping=…): left out, each joint is critically damped for the inertia that it moves
)

if __name__ == "__main__":  # python my_arm.py: is it a sound robot?
    from frobs_devkit.testing import check_robot, run_checks

    for result in run_checks(check_robot(MY_ARM)).results:
        print(result.status, result.name, result.message)
