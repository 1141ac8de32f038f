{% set has_robot = "robot" in kinds %}
{% set has_task = "task" in kinds %}
"""Records of this distribution: what it offers, by name. Nothing heavy is imported to say so."""

{% if kinds in ("task", "simulator", "controller", "robot task") %}
from frobs_core.capabilities import Level
{% endif %}
from frobs_core.hookspecs import hookimpl
{% if kinds == "robot task" %}
from frobs_core.specs import EnvironmentRecord, RobotRecord, TaskRecord
{% elif has_task %}
from frobs_core.specs import EnvironmentRecord, TaskRecord
{% else %}
from frobs_core.specs import {{ kinds.title() }}Record
{% endif %}
{% if has_robot %}


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Offer the robot."""
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
    """Offer the task, and the Gymnasium ID that joins it with a robot and a controller."""
    return [
        TaskRecord(
            name="{{ cookiecutter.__task }}",
{% if cookiecutter.example == "wheeled" %}
            summary="drive to a goal on the floor",
{% else %}
            summary="hold the tool centre point at a goal",
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
    """Offer the simulator. It is paced, as ``real_time`` says, and claims no teleporting, snapshots or pause."""
    return [
        SimulatorRecord(
            name="{{ cookiecutter.name }}",
            summary="a world that runs by the wall clock, in a process of its own",
            entry_point="{{ package }}.simulator:{{ camel(cookiecutter.name) }}",
            install_hint="pip install {{ distribution }}",
            capabilities={"real_time": Level.APPROXIMATE, "drive": Level.APPROXIMATE},
        )
    ]
{% elif kinds == "simulator" %}


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    """Offer the simulator. What it does not claim here, nobody may ask of it; what it claims is checked."""
    exact = ("determinism", "snapshot", "teleport", "pause", "batched")
    return [
        SimulatorRecord(
            name="{{ cookiecutter.name }}",
            summary="joints that move one by one, in NumPy",
            entry_point="{{ package }}.simulator:{{ camel(cookiecutter.name) }}",
            install_hint="pip install {{ distribution }}",
            capabilities={**dict.fromkeys(exact, Level.EXACT), "drive": Level.APPROXIMATE},
        )
    ]
{% endif %}
{% if kinds == "controller" %}


@hookimpl
def frobs_controllers() -> list[ControllerRecord]:
    """Offer the controller."""
    return [
        ControllerRecord(
            name="{{ cookiecutter.name }}",
            summary="actions move the commanded joint positions, smoothly",
            entry_point="{{ package }}.controller:{{ camel(cookiecutter.name) }}",
            install_hint="pip install {{ distribution }}",
            needs={"drive": Level.APPROXIMATE},
        )
    ]
{% endif %}
{% if kinds == "algorithm" %}


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Offer the algorithm."""
    return [
        AlgorithmRecord(
            name="{{ cookiecutter.name }}",
            summary="the cross-entropy method over a small network",
            entry_point="{{ package }}.algorithm:{{ camel(cookiecutter.name) }}",
            install_hint="pip install {{ distribution }}",
            action_spaces=("Box", "Discrete"),
        )
    ]
{% endif %}
