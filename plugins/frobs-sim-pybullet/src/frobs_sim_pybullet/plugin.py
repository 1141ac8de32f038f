"""Records of this distribution."""

from frobs_core.capabilities import Level
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import SimulatorRecord


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Offer PyBullet."""
    exact = (
        "determinism snapshot teleport pause drive contacts rays wrench cameras randomize_mass "
        "randomize_gains randomize_joint_damping randomize_gravity randomize_size"
    )
    return [
        SimulatorRecord(
            name="pybullet",
            summary="PyBullet: many environments at once in worker processes",
            entry_point="frobs_sim_pybullet.simulation:PybulletSimulation",
            install_hint="pip install frobs-sim-pybullet, on Python 3.11: PyBullet has no wheel for a newer one",
            capabilities={
                **dict.fromkeys(exact.split(), Level.EXACT),
                # A constraint of the engine; the drives do not know what they carry by it.
                "attachments": Level.APPROXIMATE,
                # Exact at rest; in fast motion Bullet reports a few percent too little.
                "force_torque": Level.APPROXIMATE,
                # Each environment is an engine of its own, of some 30 MB.
                "batched": Level.APPROXIMATE,
                # Bullet multiplies the friction of two bodies; only on the floor is it the larger one, as on MuJoCo.
                "randomize_friction": Level.APPROXIMATE,
            },
        )
    ]
