"""Versions of the software that a run uses."""

from __future__ import annotations

import platform
import sys
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from frobs_core.util.files import read_json

_LIBRARIES = ("numpy", "gymnasium", "mujoco", "torch", "stable-baselines3")


def versions() -> dict[str, object]:
    """Return the versions of Python, the core, the plugins and the libraries that affect numerical results."""
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


def changed_versions(path: Path) -> list[str]:
    """Return one line for each version that differs from a run's ``versions.json``."""
    try:
        then = read_json(path)
    except OSError as error:
        return [f"{path} cannot be read: {error.strerror}"]
    before, after = _flat(then), _flat(versions())
    return [
        f"{key} was {was}, and is now {after.get(key) or 'missing'}"
        for key, was in before.items()
        if was != after.get(key)
    ]


def _flat(described: Mapping[str, Any]) -> dict[str, Any]:
    own = {key: described.get(key) for key in ("python", "frobs-core", "machine")}
    groups = [described.get(group) for group in ("plugins", "libraries")]
    return own | {key: value for group in groups if isinstance(group, dict) for key, value in group.items()}
