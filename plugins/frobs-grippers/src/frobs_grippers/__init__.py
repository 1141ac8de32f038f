"""Grippers and other end effectors for FRobs."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from frobs_grippers.parallel_gripper import PARALLEL_GRIPPER as PARALLEL_GRIPPER
    from frobs_grippers.suction_cup import SUCTION_CUP as SUCTION_CUP
    from frobs_grippers.two_finger_hand import TWO_FINGER_HAND as TWO_FINGER_HAND

__all__ = ["PARALLEL_GRIPPER", "SUCTION_CUP", "TWO_FINGER_HAND"]


def __getattr__(name: str) -> Any:
    """Import an end effector on first use, so that listing plugins does not import its description."""
    if name not in __all__:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"frobs_grippers.{name.lower()}"), name)
