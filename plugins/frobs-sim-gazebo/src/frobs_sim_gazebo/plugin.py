"""Records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import Level, SimulatorRecord


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Provide Gazebo 11."""
    exact = "teleport pause contacts rays wrench randomize_gravity"
    # Each environment is a separate server. Gazebo reproduces motions closely, but not bit for bit. Gazebo's drives
    # match the drive law to first order in the timestep. For two bodies in contact, Gazebo uses the smaller friction
    # coefficient, whereas MuJoCo uses the larger one. If a link is fixed to other links, changing the link's mass does
    # not move their common center of mass.
    approximate = "batched determinism snapshot drive randomize_mass randomize_friction randomize_gains "
    approximate += "randomize_joint_damping"
    return [
        SimulatorRecord(
            name="gazebo",
            summary="Gazebo 11 in lockstep, with one server for each environment",
            entry_point="frobs_sim_gazebo.available:GazeboSimulation",
            install_hint="pip install frobs-sim-gazebo, and install Gazebo 11 with 'apt-get install gazebo' or the "
            "plugin's tools/make_root.sh",
            capabilities={
                **dict.fromkeys(exact.split(), Level.EXACT),
                **dict.fromkeys(approximate.split(), Level.APPROXIMATE),
            },
        )
    ]
