"""Records of this distribution."""

from frobs_core.capabilities import Level
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import AbilityRecord, ParameterRecord, SensorTypeRecord, SimulatorRecord

_HINT = "pip install acme-sim-ideal"


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Offer the simulator."""
    return [
        SimulatorRecord(
            name="ideal",
            summary="Joints follow their commands with a lag; no weight, no contact",
            entry_point="acme_sim_ideal.simulation:IdealSimulation",
            install_hint=_HINT,
            capabilities=dict.fromkeys(("determinism", "snapshot", "pause", "batched", "wind"), Level.EXACT),
        )
    ]


@hookimpl
def frobs_abilities() -> list[AbilityRecord]:
    """Offer an ability that the core does not know."""
    return [
        AbilityRecord(name="wind", summary="a wind that can be read", methods=("wind_velocity",), install_hint=_HINT)
    ]


@hookimpl
def frobs_sensor_types() -> list[SensorTypeRecord]:
    """Offer a sensor of this wind."""
    return [
        SensorTypeRecord(
            name="anemometer", summary="the wind", entry_point="acme_sim_ideal.wind:Anemometer", install_hint=_HINT
        )
    ]


@hookimpl
def frobs_parameters() -> list[ParameterRecord]:
    """Let the wind be randomized."""
    return [
        ParameterRecord(
            name="wind_speed", summary="speed of the wind along x [m/s]", ability="wind", install_hint=_HINT
        )
    ]
