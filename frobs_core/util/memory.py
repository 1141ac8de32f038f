"""Memory that a program can still use."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from frobs_core.util.errors import ConfigurationError

__all__ = ["available_memory", "require_memory"]

_CGROUP = Path("/sys/fs/cgroup")
"""Folder with the limits of the control group."""


def require_memory(owner: str, size: int, count: int, unit: str, advice: str) -> None:
    """Check that observations fit into the memory that is available.

    Args:
        owner: Who keeps the observations, for the error message.
        size: Number of bytes for each of ``count``.
        count: How many are kept.
        unit: What is counted, in the plural, such as ``steps``.
        advice: What the user can do, in which ``{count}`` stands for the number that fits.

    Raises:
        ConfigurationError: They do not fit.
    """
    available = available_memory()
    if size * count > available:
        raise ConfigurationError(
            f"{owner}: the observations of {count:,} {unit} need {size * count / 1e9:.1f} GB of memory, but "
            f"{available / 1e9:.1f} GB are available; {advice.format(count=f'{available // size:,}')}."
        )


def available_memory() -> int:
    """Return the memory [bytes] that this process can still use, within the limits of its control group."""
    free = [2**63]
    with suppress(OSError, ValueError):
        lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text("ascii").splitlines())
        free.append(1024 * int(lines["MemAvailable"].split()[0]))
    with suppress(OSError, ValueError, KeyError):
        limit, used = (int((_CGROUP / f"memory.{name}").read_text("ascii")) for name in ("max", "current"))
        numbers = dict(line.split() for line in (_CGROUP / "memory.stat").read_text("ascii").splitlines())
        free.append(limit - used + int(numbers["inactive_file"]))  # the kernel frees this cache if necessary
    if len(free) == 1:
        with suppress(OSError, ValueError, AttributeError):
            free.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return max(0, min(free))
