"""Names that the distributions of this project provide, for use in error messages that suggest installation commands.

``.ci/known_names.py`` generates ``known.json``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path

FILE = Path(__file__).with_name("known.json")


@cache
def known() -> Mapping[str, Mapping[str, str]]:
    """Return the distribution that provides each name, by kind.

    In addition to the kinds of records, the kinds include ``"environment"`` and ``"command"``.
    """
    names: Mapping[str, Mapping[str, str]] = json.loads(FILE.read_text("utf-8"))
    return names


def install_command(kind: str, name: str) -> str:
    """Return the command that installs a name, or an empty string if the name is unknown."""
    distribution = known().get(kind, {}).get(name, "")
    return f"pip install {distribution}" if distribution else ""
