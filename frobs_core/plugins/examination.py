"""Whether this process is one that examines plugins from outside, and must therefore load none of them itself."""

from __future__ import annotations

import os
import sys
from itertools import pairwise
from pathlib import PurePath

PROBE = "FROBS_PROBE"
"""Environment variable: set in the processes in which ``frobs doctor plugins`` imports one plugin."""


def is_examination() -> bool:
    """Return whether this is ``frobs doctor plugins``, or a process that it has started.

    The command is there for the plugin whose import hangs, and could not be reached where importing the core hangs too;
    what is imported first can only be told from the command line.
    """
    if os.environ.get(PROBE):
        return True
    frobs = PurePath(sys.argv[0]).stem.startswith("frobs") or "frobs_core.cli" in sys.orig_argv
    words = [word for word in sys.orig_argv if word != "--debug"]
    return frobs and ("doctor", "plugins") in pairwise(words)
