"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Offer the arms."""
    return [
        RobotRecord(
            name="irb120",
            summary="ABB IRB 120: six axes, 3 kg payload, 0.58 m reach",
            entry_point="frobs_robots_abb.irb120:IRB120",
            install_hint="pip install frobs-robots-abb",
        )
    ]
