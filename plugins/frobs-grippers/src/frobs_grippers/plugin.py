"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord

_SUMMARIES = {
    "parallel_gripper": "gripper with the dimensions of the Robotiq 2F-85: 85 mm stroke, 20 to 235 N, 0.9 kg",
    "suction_cup": "40 mm suction cup with a force-torque sensor; cannot hold objects yet",
    "two_finger_hand": "gripper with the dimensions of the Franka hand: 80 mm stroke, 70 N, 0.73 kg",
}


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Return the records of the end effectors."""
    return [
        RobotRecord(
            name=name,
            summary=summary,
            entry_point=f"frobs_grippers.{name}:{name.upper()}",
            install_hint="pip install frobs-grippers",
        )
        for name, summary in _SUMMARIES.items()
    ]
