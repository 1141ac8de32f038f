"""Replacement for MoveIt's ``moveit_commander``, which 'frobs legacy run' uses if MoveIt is not installed."""

from collections.abc import Sequence

from frobs_rl_compat.moveit.errors import MoveItCommanderException, NotOfferedError
from frobs_rl_compat.moveit.group import MoveGroupCommander
from frobs_rl_compat.moveit.robot import RobotCommander
from frobs_rl_compat.moveit.scene_interface import PlanningSceneInterface

__all__ = [
    "MoveGroupCommander", "MoveItCommanderException", "PlanningSceneInterface", "RobotCommander",
    "roscpp_initialize", "roscpp_shutdown",
]  # fmt: skip


def roscpp_initialize(args: Sequence[str]) -> None:
    """Do nothing, because this replacement has no C++ node. A commander starts a ROS node if the process has none."""
    del args


def roscpp_shutdown() -> None:
    """Do nothing, because this replacement has no C++ node."""


def __getattr__(name: str) -> object:
    if name.startswith("__"):
        raise AttributeError(name)
    raise NotOfferedError("moveit_commander", name, __all__)
