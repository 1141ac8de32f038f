"""Versions of the software that a run uses."""

from __future__ import annotations

import platform
import sys
from importlib import metadata
from pathlib import Path
from typing import cast

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
    now = versions()
    lines = []
    for group, name in (("", "python"), ("", "frobs-core"), ("plugins", ""), ("libraries", ""), ("", "machine")):
        if name:
            pairs = {name: (then.get(name), now[name])}
        else:
            previous, after = then.get(group), cast("dict[str, str]", now[group])
            before = previous if isinstance(previous, dict) else {}
            pairs = {key: (before[key], after.get(key)) for key in before}
        lines += [
            f"{key} was {was}, and is now {here or 'missing'}" for key, (was, here) in pairs.items() if was != here
        ]
    return lines
