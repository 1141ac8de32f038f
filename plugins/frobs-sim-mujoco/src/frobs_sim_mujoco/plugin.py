"""Records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import Level, SimulatorRecord


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Provide MuJoCo."""
    exact = (
        "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras "
        "camera_intrinsics randomize_mass randomize_friction randomize_gains randomize_joint_damping randomize_gravity "
        "randomize_size randomize_looks randomize_cameras randomize_scenery"
    )
    return [
        SimulatorRecord(
            name="mujoco",
            summary="MuJoCo: steps many environments in parallel on a thread pool",
            entry_point="frobs_sim_mujoco.simulation:MujocoSimulation",
            install_hint="pip install frobs-sim-mujoco",
            capabilities=dict.fromkeys(exact.split(), Level.EXACT),
        )
    ]
