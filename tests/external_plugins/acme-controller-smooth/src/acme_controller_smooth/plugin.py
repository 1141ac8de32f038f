"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import ControllerRecord


@hookimpl
def frobs_controllers() -> list[ControllerRecord]:
    """Offer the controller."""
    return [
        ControllerRecord(
            name="smooth",
            summary="Joint steps that are smoothed, for arms that should not jerk",
            entry_point="acme_controller_smooth.smooth:Smooth",
            install_hint="pip install acme-controller-smooth",
        )
    ]
