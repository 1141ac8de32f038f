"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Return the records of the arm with and without a hand."""
    return [
        RobotRecord(
            name="panda",
            summary="Franka Emika Panda with a hand: seven axes, two fingers, 3 kg payload, 0.86 m reach",
            entry_point="frobs_robots_franka.panda:PANDA",
            install_hint="pip install frobs-robots-franka",
        ),
        RobotRecord(
            name="panda_arm",
            summary="Franka Emika Panda without a hand: seven axes, 3 kg payload, 0.86 m reach",
            entry_point="frobs_robots_franka.panda_arm:PANDA_ARM",
            install_hint="pip install frobs-robots-franka",
        ),
    ]
