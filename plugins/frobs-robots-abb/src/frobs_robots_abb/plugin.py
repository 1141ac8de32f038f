"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord


def _record(name: str, summary: str) -> RobotRecord:
    return RobotRecord(
        name=name,
        summary=summary,
        entry_point=f"frobs_robots_abb.{name}:{name.upper()}",
        install_hint="pip install frobs-robots-abb",
    )


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Return the records of the arms."""
    return [
        _record("irb120", "ABB IRB 120: six axes, 3 kg payload, 0.58 m reach"),
        _record("irb140", "ABB IRB 140: six axes, 6 kg payload, 0.81 m reach"),
    ]
