"""FRobs, a plugin-based framework for robot reinforcement learning.

Importing this package discovers the installed plugins and registers their Gymnasium IDs. The import does not load
physics engines, torch or ROS. If ``FROBS_NO_PLUGINS=1`` is set, and during shell completion, the import does not load
plugins. For example, ``frobs doctor plugins`` sets ``FROBS_NO_PLUGINS`` and examines each plugin in a separate process.
"""

import os
from typing import TYPE_CHECKING, Any

from frobs_core import deprecation
from frobs_core._version import __version__ as __version__

if TYPE_CHECKING:
    from frobs_core.kernel.policies import load_policy as load_policy

__all__ = ["load_policy", "plugins", "registry"]

deprecation.keep_moved_modules()

if not os.environ.get("FROBS_NO_PLUGINS") and "_FROBS_COMPLETE" not in os.environ:
    from frobs_core import plugins as plugins
    from frobs_core.plugins import registry as registry

    registry.register_environments()


def __getattr__(name: str) -> Any:
    """Return ``load_policy``, whose module imports the contracts."""
    if name != "load_policy":
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from frobs_core.kernel.policies import load_policy

    return load_policy
