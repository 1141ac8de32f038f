"""Install commands in error messages.

By default, install commands in messages use the distributions' names: ``pip install frobs-sim-mujoco``. In a checkout
of the repository, ``local_install_hint`` replaces each name with the distribution's folder:
``pip install -e plugins/frobs-sim-mujoco``.
"""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["local_install_hint"]

CHECKOUT = Path(__file__).resolve().parents[2]
"""The folder that contains ``frobs_core``: the repository, or ``site-packages``."""

_REQUIREMENT = re.compile(
    r"(?<![\w./'\"-])(['\"]?)(frobs(?:-[a-z0-9]+)*)(\[[a-z0-9,-]+\])?([<>=~!][0-9.<>=~!,]*)?\1(?![\w\[<>=~!-])"
)


def local_install_hint(command: str) -> str:
    """Return an install command that works for the current installation.

    Args:
        command: Text with ``pip install NAME``. Only the names of distributions with a folder in the checkout are
            replaced.

    Returns:
        The command, which is unchanged if FRobs is not installed from a checkout.
    """
    before, pip, names = command.partition("pip install ")
    if not pip or not (CHECKOUT / "plugins").is_dir():
        return command
    return before + pip + _REQUIREMENT.sub(_editable, names)


def _editable(match: re.Match[str]) -> str:
    """Return ``-e FOLDER`` for a requirement whose distribution has a folder in the checkout."""
    name, extras = match[2], match[3] or ""
    folder = CHECKOUT if name == "frobs-core" else CHECKOUT / "plugins" / name
    if not (folder / "pyproject.toml").is_file():
        return match[0]
    try:
        shown = str(folder.relative_to(Path.cwd()))
    except (OSError, ValueError):  # the folder is not below the working directory, or the working directory was removed
        shown = str(folder)
    quote = "'" if extras else ""
    return f"-e {quote}{shown}{extras}{quote}"
