"""FRobs: robot reinforcement learning from plugins.

Importing this package finds the installed plugins and registers their Gymnasium IDs. It imports no engine, no
torch and no ROS. On a machine that only runs policies, without Gymnasium, there is nothing to register, and
:mod:`frobs_core.deploy` works alone.
"""

from importlib.util import find_spec

from frobs_core._version import __version__ as __version__

__all__ = ["plugins", "registry"]

if find_spec("gymnasium") and find_spec("pluggy"):
    from frobs_core import plugins as plugins
    from frobs_core import registry as registry
    from frobs_core.plugins.examination import is_examination as _is_examination

    if not _is_examination():
        registry.register_environments()
