"""Reaching tasks for FRobs."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from frobs_tasks_reach.motion import Oscillation as Oscillation
    from frobs_tasks_reach.reach import Reach as Reach
    from frobs_tasks_reach.reach import distance as distance
    from frobs_tasks_reach.reset_options import checked_goal as checked_goal
    from frobs_tasks_reach.sampling import JointSampler as JointSampler
    from frobs_tasks_reach.together import ReachTogether as ReachTogether

_MODULES = {
    "JointSampler": "frobs_tasks_reach.sampling",
    "Oscillation": "frobs_tasks_reach.motion",
    "Reach": "frobs_tasks_reach.reach",
    "ReachTogether": "frobs_tasks_reach.together",
    "checked_goal": "frobs_tasks_reach.reset_options",
    "distance": "frobs_tasks_reach.reach",
}
__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that listing plugins does not import the tasks."""
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)
