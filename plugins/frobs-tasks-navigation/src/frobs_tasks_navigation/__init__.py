"""Navigation tasks for FRobs."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from frobs_tasks_navigation.navigate import Navigate as Navigate

_MODULES = {
    "Navigate": "frobs_tasks_navigation.navigate",
}
__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that listing plugins does not import the tasks."""
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)
