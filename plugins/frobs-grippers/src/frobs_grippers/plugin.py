"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Offer the end effectors."""
    return [
        RobotRecord(
            name="two_finger_hand",
            summary="gripper in the size of the Franka hand: two fingers, 80 mm, 70 N",
            entry_point="frobs_grippers.two_finger_hand:TWO_FINGER_HAND",
            install_hint="pip install frobs-grippers",
        ),
    ]
