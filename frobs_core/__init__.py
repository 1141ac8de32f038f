"""FRobs: robot reinforcement learning from plugins.

Importing this package finds the installed plugins and registers their Gymnasium IDs. It imports no engine, no
torch and no ROS. Two kinds of processes load no plugin and register nothing: those with ``FROBS_NO_PLUGINS=1``, which
examine plugins from outside (``frobs doctor plugins``), and shells that complete a command line, which only need names.
"""

import os

from frobs_core._version import __version__ as __version__

__all__ = ["plugins", "registry"]

if not os.environ.get("FROBS_NO_PLUGINS") and "_FROBS_COMPLETE" not in os.environ:
    from frobs_core import plugins as plugins
    from frobs_core import registry as registry

    registry.register_environments()
