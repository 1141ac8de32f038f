"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Offer the arm."""
    return [
        RobotRecord(
            name="scara",
            summary="Planar arm of two joints, 0.5 m reach",
            entry_point="acme_robot_scara.scara:SCARA",
            install_hint="pip install acme-robot-scara",
        )
    ]
