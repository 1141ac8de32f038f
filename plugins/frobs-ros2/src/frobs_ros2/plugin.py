"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import Level, SimulatorRecord


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Return the records of the paced simulators."""
    drives = {"real_time": Level.APPROXIMATE, "drive": Level.APPROXIMATE}
    return [
        SimulatorRecord(
            name="ros2",
            summary="a robot behind ROS 2 topics, in real time",
            entry_point="frobs_ros2.simulation:Ros2Simulation",
            install_hint="pip install 'frobs-ros2[rclpy]'",
            capabilities={**drives, "cameras": Level.APPROXIMATE},
        ),
        SimulatorRecord(
            name="safe",
            summary="safety rules around another paced simulator",
            entry_point="frobs_ros2.safe:SafeSimulation",
            install_hint="pip install frobs-ros2",
            capabilities=drives,
        ),
    ]
