"""Records of this distribution."""

import sys
from importlib.util import find_spec

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import Level, SimulatorRecord


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Provide PyBullet."""
    exact = (
        "determinism snapshot teleport pause drive contacts rays wrench cameras camera_intrinsics randomize_mass "
        "randomize_gains randomize_joint_damping randomize_gravity randomize_size "
        "randomize_looks randomize_cameras"
    )
    return [
        SimulatorRecord(
            name="pybullet",
            summary=_summary(),
            entry_point="frobs_sim_pybullet.simulation:PybulletSimulation",
            install_hint="pip install frobs-sim-pybullet (requires Python 3.11, because PyBullet has no newer wheels)",
            capabilities={
                **dict.fromkeys(exact.split(), Level.EXACT),
                # Attachments are constraints in the engine, and the drive law does not include the attached mass.
                "attachments": Level.APPROXIMATE,
                # Readings are exact at rest. During fast motion, the forces and torques that Bullet reports are a few
                # percent too low.
                "force_torque": Level.APPROXIMATE,
                # Each environment is a separate engine instance that requires about 30 MB of memory.
                "batched": Level.APPROXIMATE,
                # Bullet multiplies the friction coefficients of two touching bodies. Only contacts with the floor use
                # the larger of the two coefficients, as all contacts do in MuJoCo.
                "randomize_friction": Level.APPROXIMATE,
            },
        )
    ]


def _summary() -> str:
    """Return the summary for ``frobs list``, which suggests an alternative if PyBullet does not support this Python version."""
    if sys.version_info < (3, 12) or find_spec("pybullet"):
        return "PyBullet: many environments in parallel worker processes"
    return (
        f"PyBullet has no wheel for Python {sys.version_info[0]}.{sys.version_info[1]}: use Python 3.11, or the "
        "simulator mujoco"
    )
