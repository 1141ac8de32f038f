"""FRobs: robot reinforcement learning from plugins.

Importing this package finds the installed plugins and registers their Gymnasium IDs. It does not import an engine,
torch or ROS. Plugins are not loaded if ``FROBS_NO_PLUGINS=1`` is set (``frobs doctor plugins`` examines plugins from a
process without them) or during shell completion, which needs only the names.
"""

import os

from frobs_core._version import __version__ as __version__

__all__ = ["plugins", "registry"]

if not os.environ.get("FROBS_NO_PLUGINS") and "_FROBS_COMPLETE" not in os.environ:
    from frobs_core import plugins as plugins
    from frobs_core import registry as registry

    registry.register_environments()
