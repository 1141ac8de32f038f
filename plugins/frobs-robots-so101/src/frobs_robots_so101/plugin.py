"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Return the record of the arm."""
    return [
        RobotRecord(
            name="so101",
            summary="SO-101, a low-cost open arm: five axes, one moving jaw, 0.4 m reach",
            entry_point="frobs_robots_so101.so101:SO101",
            install_hint="pip install frobs-robots-so101",
        )
    ]
