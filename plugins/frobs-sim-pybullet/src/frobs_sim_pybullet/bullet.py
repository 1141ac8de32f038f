"""Imports PyBullet without printing its greeting, because standard output may be reserved for JSON."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from frobs_core.util.errors import PluginError

__all__ = ["pybullet", "quiet"]


@contextmanager
def quiet() -> Iterator[None]:
    """Discard all output of native code to standard output and standard error inside a ``with`` block."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    kept, nowhere = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept[0], 1)
        os.dup2(kept[1], 2)
        for file in (*kept, nowhere):
            os.close(file)


try:
    with quiet():
        import pybullet
except ImportError as error:
    if sys.version_info < (3, 12):
        raise ImportError(f"PyBullet is not installed ({error}); install it with 'pip install pybullet'") from error
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    raise PluginError(f"PyBullet has no wheel for Python {version}: use Python 3.11, or simulator='mujoco'") from error
