"""What a run was made with."""

from __future__ import annotations

import platform
import sys
from importlib import metadata

_LIBRARIES = ("numpy", "gymnasium", "mujoco", "torch", "stable-baselines3")


def versions() -> dict[str, object]:
    """Return the versions of Python, the core, the plugins and the libraries that decide over numbers."""
    from frobs_core import __version__, plugins

    libraries = {}
    for name in _LIBRARIES:
        try:
            libraries[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return {
        "python": platform.python_version(),
        "frobs-core": __version__,
        "plugins": {report.distribution: report.version for report in plugins.reports() if report.state == "loaded"},
        "libraries": libraries,
        "platform": platform.platform(),
        "machine": platform.machine(),
        "byteorder": sys.byteorder,
    }
