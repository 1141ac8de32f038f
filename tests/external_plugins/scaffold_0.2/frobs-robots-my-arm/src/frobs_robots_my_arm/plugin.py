"""Records of the parts that this distribution provides. This module imports only lightweight modules."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Provide the robot."""
    return [
        RobotRecord(
            name="my_arm",
            summary="an arm with two joints",
            entry_point="frobs_robots_my_arm.robot:MY_ARM",
            install_hint="pip install frobs-robots-my-arm",
        )
    ]
