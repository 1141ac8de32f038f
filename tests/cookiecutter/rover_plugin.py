"""A plugin with a wheeled robot, so that a task alone can be made for one."""

import sys
from pathlib import Path

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord

TEMPLATES = Path(__file__).parents[2] / "templates"


def __getattr__(name: str) -> object:
    if name != "MY_ROVER":
        raise AttributeError(name)
    sys.path.insert(0, str(TEMPLATES))
    try:
        from my_rover import MY_ROVER
    finally:
        sys.path.remove(str(TEMPLATES))
    return MY_ROVER


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    return [RobotRecord(name="my_rover", summary="two driven wheels", entry_point="rover_plugin:MY_ROVER")]
