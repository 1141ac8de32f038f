"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Return the records of the arm with and without a gripper."""
    return [
        RobotRecord(
            name="ur5",
            summary="Universal Robots UR5: six axes, 5 kg payload, 0.85 m reach",
            entry_point="frobs_robots_ur.ur5:UR5",
            install_hint="pip install frobs-robots-ur",
        ),
        RobotRecord(
            name="ur5_gripper",
            summary="Universal Robots UR5 with a parallel gripper of the same size as the Robotiq 2F-85",
            entry_point="frobs_robots_ur.ur5_gripper:UR5_GRIPPER",
            install_hint="pip install frobs-robots-ur",
        ),
    ]
