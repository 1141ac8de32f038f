"""Motion planning for FRobs."""

from importlib import import_module
from typing import Any

_MODULES = {
    "Plan": "frobs_controllers_planning.plan",
    "Planner": "frobs_controllers_planning.planner",
    "Reason": "frobs_controllers_planning.plan",
    "ToolGoal": "frobs_controllers_planning.plan",
}
__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that loading the plugin does not import the planning libraries."""
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)
