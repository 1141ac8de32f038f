"""Plugin records of this distribution."""

from typing import Any

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import EnvironmentRecord, Level, TaskRecord

_INSTALL = "pip install frobs-tasks-legacy"
_TELEPORT = {"teleport": Level.APPROXIMATE}


def _environment(name: str, summary: str, max_episode_steps: int, **fields: Any) -> EnvironmentRecord:
    """Return the record of the environment ``frobs/NAME-v0``, which includes a pretrained policy."""
    return EnvironmentRecord(
        id=f"frobs/{name}-v0",
        summary=summary,
        max_episode_steps=max_episode_steps,
        pretrained=f"frobs_tasks_legacy:pretrained/{name.lower()}.frobs",
        **fields,
    )


def _reach(name: str, robot: str, title: str, control_timestep: float) -> EnvironmentRecord:
    """Return the record of a reaching environment whose drives complete a motion in ``control_timestep`` [s]."""
    return _environment(
        f"{name}ReachLegacy",
        f"{title} reach as in FRobs_RL",
        100,
        robot=robot,
        controller="joint_delta_position",
        parameters={"controller_kwargs": {"full_range": True}, "control_timestep": control_timestep, "profile": robot},
    )


def _kobuki(name: str, summary: str, world: str, speed: float) -> EnvironmentRecord:
    """Return the record of a Kobuki environment whose maximum velocities are ``speed`` [m/s and rad/s]."""
    limits = {"max_linear_velocity": speed, "max_angular_velocity": speed}
    sensors = {"sensors": {"lidar": {"rays": 36}}} if world == "dynamic" else {}
    return _environment(
        name,
        summary,
        2000,
        robot="kobuki",
        controller="differential_drive",
        parameters={"world": world, "controller_kwargs": limits, **sensors},
    )


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Return the records of FRobs_RL's tasks."""
    return [
        TaskRecord(
            name="reach_legacy",
            summary="FRobs_RL's reaching task, with its observation, reward, termination and task YAML files",
            entry_point="frobs_tasks_legacy.reach.task:ReachLegacy",
            install_hint=_INSTALL,
            needs=_TELEPORT,
            environments=(
                _reach("Irb120", "irb120", "IRB 120", 0.5),
                _reach("Irb140", "irb140", "IRB 140", 0.5),
                _reach("Ur5", "ur5", "UR5", 1.0),
            ),
        ),
        TaskRecord(
            name="reach_legacy_velocity",
            summary="FRobs_RL's reaching task with joint velocity control",
            entry_point="frobs_tasks_legacy.reach.velocity:ReachLegacyVelocity",
            install_hint=_INSTALL,
            needs=_TELEPORT,
            environments=(
                _environment(
                    "Irb140ReachVelocityLegacy",
                    "FRobs_RL's IRB 140 reaching task with joint velocity control",
                    100,
                    algorithm="td3",
                    robot="irb140",
                    controller="joint_velocity",
                    parameters={"controller_kwargs": {"max_velocity": 0.2}},
                ),
            ),
        ),
        TaskRecord(
            name="navigate_legacy",
            summary="FRobs_RL's navigation tasks, with their observations, rewards, termination and task YAML files",
            entry_point="frobs_tasks_legacy.navigation.task:NavigateLegacy",
            install_hint=_INSTALL,
            needs={**_TELEPORT, "contacts": Level.APPROXIMATE},
            environments=(
                _kobuki("KobukiEmptyLegacy", "Kobuki on an empty floor as in FRobs_RL", "empty", 0.3),
                _kobuki("KobukiDynamicLegacy", "Kobuki among moving boxes as in FRobs_RL", "dynamic", 1.0),
                _kobuki("KobukiMazeLegacy", "Kobuki in the maze as in FRobs_RL", "maze", 1.0),
            ),
        ),
    ]
