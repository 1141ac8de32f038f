"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Return the record of the robot."""
    return [
        RobotRecord(
            name="kobuki",
            summary="Kobuki: two driven wheels, a 360° lidar and a bumper",
            entry_point="frobs_robots_kobuki.kobuki:KOBUKI",
            install_hint="pip install frobs-robots-kobuki",
        )
    ]
