"""Records of this distribution."""

from typing import Any

from frobs_core.capabilities import Level
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import EnvironmentRecord, TaskRecord

_INSTALL = "pip install frobs-tasks-navigation"
_NEEDS = {"teleport": Level.APPROXIMATE, "contacts": Level.APPROXIMATE}
_RAYS_36 = {"lidar": {"rays": 36}}
_GOAL = ("distance", "bearing")
_MAZE = ("distance", "bearing", "position", "yaw", "way_point", "nearness")  # FRobs_RL's 15 numbers


def _kobuki(id: str, summary: str, max_episode_steps: int, **parameters: Any) -> EnvironmentRecord:
    """Return a record; its trained policy is made by ``tests/benchmarks/pretrained.py``."""
    name = id.removeprefix("frobs/").removesuffix("-v0")
    return EnvironmentRecord(
        id=id,
        summary=summary,
        robot="kobuki",
        controller="differential_drive",
        max_episode_steps=max_episode_steps,
        parameters=parameters,
        pretrained=f"frobs_tasks_navigation:pretrained/{name.lower()}.frobs",
    )


def _legacy(id: str, summary: str, world: str, speed: float) -> EnvironmentRecord:
    """Return a record of FRobs_RL's; ``speed`` [m/s, rad/s] is that of an action of 1."""
    limits = {"max_linear_velocity": speed, "max_angular_velocity": speed}
    sensors = {"sensors": _RAYS_36} if world == "dynamic" else {}
    return _kobuki(id, summary, 2000, world=world, controller_kwargs=limits, **sensors)


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Offer the navigation tasks."""
    return [
        TaskRecord(
            name="navigate",
            summary="drive past way-points to a goal, among the walls and boxes of a floor plan",
            entry_point="frobs_tasks_navigation.navigate:Navigate",
            install_hint=_INSTALL,
            needs=_NEEDS,
            environments=(
                _kobuki(
                    "frobs/KobukiEmpty-v0",
                    "Kobuki drives to a goal on an empty floor",
                    400,
                    floor_plan="empty",
                    observation=_GOAL,
                ),
                _kobuki(
                    "frobs/KobukiDynamic-v0",
                    "Kobuki drives to a goal among eight boxes that move",
                    300,
                    floor_plan="dynamic",
                    sensors=_RAYS_36,
                    observation=(*_GOAL, "nearness"),
                ),
                _kobuki(
                    "frobs/KobukiMaze-v0",
                    "Kobuki drives one of four routes through a maze with two boxes that move",
                    500,
                    floor_plan="maze",
                    observation=_MAZE,
                ),
                EnvironmentRecord(
                    id="frobs/Navigate-v0",
                    summary="any wheeled robot with a lidar in a floor plan of one's own: give them with robot=…, floor_plan=…",
                    robot="",
                    controller="differential_drive",
                    max_episode_steps=500,
                ),
            ),
        ),
        TaskRecord(
            name="navigate_legacy",
            summary="navigation as FRobs_RL had it: its observations, rewards and ends, and its task YAML",
            entry_point="frobs_tasks_navigation.legacy:NavigateLegacy",
            install_hint=_INSTALL,
            needs=_NEEDS,
            environments=(
                _legacy("frobs/KobukiEmptyLegacy-v0", "Kobuki on an empty floor as FRobs_RL had it", "empty", 0.3),
                _legacy("frobs/KobukiDynamicLegacy-v0", "Kobuki among moving boxes as FRobs_RL had it", "dynamic", 1.0),
                _legacy("frobs/KobukiMazeLegacy-v0", "Kobuki in the maze as FRobs_RL had it", "maze", 1.0),
            ),
        ),
    ]
