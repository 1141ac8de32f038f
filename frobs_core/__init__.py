"""FRobs: robot reinforcement learning from plugins.

Importing this package finds the installed plugins and registers their Gymnasium IDs. It imports no engine, no
torch and no ROS.
"""

from frobs_core import plugins as plugins
from frobs_core import registry as registry

__all__ = ["plugins", "registry"]
__version__ = "0.1.0"

registry.register_environments()
