"""FRobs: robot reinforcement learning from plugins.

Importing this package finds the installed plugins and registers their Gymnasium IDs. It imports no engine, no
torch and no ROS.
"""

from frobs_core import plugins as plugins
from frobs_core import registry as registry
from frobs_core._version import __version__ as __version__
from frobs_core.plugins.examination import is_examination

__all__ = ["plugins", "registry"]

if not is_examination():
    registry.register_environments()
