"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import Level, SimulatorRecord

ROS = SimulatorRecord(
    name="ros",
    summary="a robot behind ROS 1 topics, in real time",
    entry_point="frobs_ros.robot.simulation:RosSimulation",
    install_hint="pip install frobs-ros",
    capabilities=dict.fromkeys(("real_time", "drive", "rays"), Level.APPROXIMATE),
)


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Return the record of the paced simulator."""
    return [ROS]
