"""Viewers of environments by their name, which is a render mode."""

from __future__ import annotations

from typing import Any

from frobs_core import plugins
from frobs_core.contracts.viewer import Viewer
from frobs_core.plugins.records import ViewerRecord
from frobs_core.util.errors import ParameterValueError, nearest
from frobs_core.util.install_hints import local_install_hint

PICTURE = "rgb_array"
"""Render mode whose ``render`` returns an image."""

WINDOW = "human"
"""Render mode that opens the window of the simulator."""


def render_modes() -> list[str]:
    """Return the valid values of ``render_mode``: images, the engine's window, and the names of other viewers."""
    return [PICTURE, WINDOW, *(name for name in plugins.records(ViewerRecord) if name != WINDOW)]


def check_render_mode(mode: str) -> None:
    """Check that a render mode is installed.

    Raises:
        ParameterValueError: No installed plugin provides a viewer with this name.
    """
    modes = render_modes()
    if mode in modes:
        return
    rule = f"one of {', '.join(map(repr, modes))}"
    if command := plugins.install_command("viewer", mode):
        rule += f"; to install '{mode}': {local_install_hint(command)}"
    elif close := nearest(str(mode), modes):
        rule += f" (did you mean '{close}'?)"
    raise ParameterValueError("render_mode", mode, rule)


def open_viewer(env: Any, mode: str | None) -> Viewer | None:
    """Return the viewer of an environment, which is bound and called after each step, or None if nothing is shown.

    Args:
        env: The environment.
        mode: Its render mode.

    Raises:
        FrobsError: The viewer cannot be imported, or cannot show this environment.
    """
    if mode is None or mode == PICTURE:
        return None
    try:
        viewer: Viewer = plugins.get_record("viewer", mode).load()()
        viewer.bind(env)
    except BaseException:
        env.simulation.close()
        raise
    env.after_step.append(lambda result: viewer.update())
    return viewer


class Metadata:
    """Class attribute ``metadata`` of an environment: the render modes that are installed when it is read."""

    def __get__(self, env: object, cls: type) -> dict[str, Any]:
        """Return Gymnasium's metadata."""
        return {"render_modes": render_modes()}
