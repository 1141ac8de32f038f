{% set has_robot = "robot" in kinds %}
{% set has_task = "task" in kinds %}
"""Records of the parts that this distribution provides. This module imports only lightweight modules."""

from frobs_core.plugins.hooks import hookimpl
{% if kinds == "robot task" %}
from frobs_core.plugins.records import EnvironmentRecord, Level, RobotRecord, TaskRecord
{% elif has_task %}
from frobs_core.plugins.records import EnvironmentRecord, Level, TaskRecord
{% elif kinds == "controller" %}
from frobs_core.plugins.records import ControllerRecord, Level
{% elif kinds == "simulator" %}
from frobs_core.plugins.records import Level, SimulatorRecord
{% else %}
from frobs_core.plugins.records import {{ kinds.title() }}Record
{% endif %}
{% if has_robot %}


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Provide the robot."""
    return [
        RobotRecord(
            name="{{ cookiecutter.name }}",
{% if cookiecutter.example == "file" %}
            summary="{{ robot_file().summary }}",
{% elif cookiecutter.example == "wheeled" %}
            summary="two driven wheels",
{% else %}
            summary="an arm with two joints",
{% endif %}
            entry_point="{{ package }}.robot:{{ cookiecutter.name.upper() }}",
            install_hint="pip install {{ distribution }}",
        )
    ]
{% endif %}
{% if has_task %}


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Provide the task and a Gymnasium ID that combines the task with a robot and a controller."""
    return [
        TaskRecord(
            name="{{ cookiecutter.__task }}",
{% if cookiecutter.example == "wheeled" %}
            summary="drive to a goal on the floor",
{% else %}
            summary="hold the tool center point at a goal",
{% endif %}
            entry_point="{{ package }}.task:{{ camel(cookiecutter.__task) }}",
            install_hint="pip install {{ distribution }}",
            needs={"teleport": Level.APPROXIMATE},
            environments=(
                EnvironmentRecord(
                    id="{{ cookiecutter.__id }}",
{% if cookiecutter.example == "wheeled" %}
                    summary="{{ cookiecutter.__robot }} drives to a goal",
{% else %}
                    summary="{{ cookiecutter.__robot }} holds its tool at a goal",
{% endif %}
                    robot="{{ cookiecutter.__robot }}",
                    controller="{{ cookiecutter.__controller }}",
                    max_episode_steps={{ 50 if cookiecutter.__controller == "joint_delta_position" else 100 }},
                ),
            ),
        )
    ]
{% endif %}
{% if cookiecutter.__paced %}


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Provide the simulator. It runs in real time and does not support teleporting, snapshots or pausing."""
    return [
        SimulatorRecord(
            name="{{ cookiecutter.name }}",
            summary="a world that runs in real time in a separate process",
            entry_point="{{ package }}.simulator:{{ camel(cookiecutter.name) }}",
            install_hint="pip install {{ distribution }}",
            capabilities={"real_time": Level.APPROXIMATE, "drive": Level.APPROXIMATE},
        )
    ]
{% elif kinds == "simulator" %}


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Provide the simulator. Tasks can use only the capabilities declared here. The conformance kit verifies them."""
    exact = ("determinism", "snapshot", "teleport", "pause", "batched")
    return [
        SimulatorRecord(
            name="{{ cookiecutter.name }}",
            summary="independently moving joints, simulated with NumPy",
            entry_point="{{ package }}.simulator:{{ camel(cookiecutter.name) }}",
            install_hint="pip install {{ distribution }}",
            capabilities={**dict.fromkeys(exact, Level.EXACT), "drive": Level.APPROXIMATE},
        )
    ]
{% endif %}
{% if kinds == "controller" %}


@hookimpl
def frobs_controllers() -> list[ControllerRecord]:
    """Provide the controller."""
    return [
        ControllerRecord(
            name="{{ cookiecutter.name }}",
            summary="actions move the commanded joint positions smoothly",
            entry_point="{{ package }}.controller:{{ camel(cookiecutter.name) }}",
            install_hint="pip install {{ distribution }}",
            needs={"drive": Level.APPROXIMATE},
        )
    ]
{% endif %}
{% if kinds == "algorithm" %}


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Provide the algorithm."""
    return [
        AlgorithmRecord(
            name="{{ cookiecutter.name }}",
            summary="the cross-entropy method for a small network",
            entry_point="{{ package }}.algorithm:{{ camel(cookiecutter.name) }}",
            install_hint="pip install {{ distribution }}",
            action_spaces=("Box", "Discrete"),
        )
    ]
{% endif %}
