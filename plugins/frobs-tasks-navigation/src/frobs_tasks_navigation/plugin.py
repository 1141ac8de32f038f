"""Plugin records of this distribution."""

from typing import Any

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import EnvironmentRecord, Level, TaskRecord

_INSTALL = "pip install frobs-tasks-navigation"
_NEEDS = {"teleport": Level.APPROXIMATE, "contacts": Level.APPROXIMATE}
_RAYS_36 = {"lidar": {"rays": 36}}
_GOAL = ("distance", "bearing")
_MAZE = ("distance", "bearing", "position", "yaw", "way_point", "nearness")  # the 15 numbers of FRobs_RL's observation


def _kobuki(id: str, summary: str, max_episode_steps: int, **parameters: Any) -> EnvironmentRecord:
    """Return the record of an environment whose policy is trained by ``tests/benchmarks/pretrained.py``."""
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


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Return the record of the navigation task."""
    return [
        TaskRecord(
            name="navigate",
            summary="drive through waypoints to a goal, among the walls and boxes of a floor plan",
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
                    "Kobuki drives to a goal among eight moving boxes",
                    300,
                    floor_plan="dynamic",
                    sensors=_RAYS_36,
                    observation=(*_GOAL, "nearness"),
                ),
                _kobuki(
                    "frobs/KobukiMaze-v0",
                    "Kobuki drives one of four routes through a maze with two moving boxes",
                    500,
                    floor_plan="maze",
                    observation=_MAZE,
                ),
                EnvironmentRecord(
                    id="frobs/Navigate-v0",
                    summary="any wheeled robot with a lidar in any floor plan: set robot=… and floor_plan=…",
                    robot="",
                    controller="differential_drive",
                    max_episode_steps=500,
                ),
            ),
        )
    ]
