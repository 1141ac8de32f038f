"""Records of this distribution."""

from frobs_core.capabilities import Level
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import SimulatorRecord


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Offer the simulator."""
    return [
        SimulatorRecord(
            name="ideal",
            summary="Joints follow their commands with a lag; no weight, no contact",
            entry_point="acme_sim_ideal.simulation:IdealSimulation",
            install_hint="pip install acme-sim-ideal",
            capabilities=dict.fromkeys(("determinism", "snapshot", "pause", "batched"), Level.EXACT),
        )
    ]
