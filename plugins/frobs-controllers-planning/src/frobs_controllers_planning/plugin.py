"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import ControllerRecord, Level


@hookimpl
def frobs_controllers() -> list[ControllerRecord]:
    """Return the record of the controller."""
    return [
        ControllerRecord(
            name="trajectory",
            summary="an action is a complete motion, planned around obstacles",
            entry_point="frobs_controllers_planning.controller:TrajectoryController",
            install_hint="pip install frobs-controllers-planning",
            needs={"drive": Level.APPROXIMATE},
            control_timestep=4.0,
        )
    ]
