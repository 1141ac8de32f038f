"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Offer the arm, alone and with an end effector."""
    return [
        RobotRecord(
            name="scara",
            summary="Planar arm of two joints, 0.5 m reach",
            entry_point="acme_robot_scara.scara:SCARA",
            install_hint="pip install acme-robot-scara",
        ),
        RobotRecord(
            name="scara_with_pointer",
            summary="The same arm with a stick at its tip",
            entry_point="acme_robot_scara.pointer:SCARA_WITH_POINTER",
            install_hint="pip install acme-robot-scara",
        ),
    ]
