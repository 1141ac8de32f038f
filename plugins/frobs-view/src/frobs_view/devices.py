"""Keys and gamepads of the people who look at a page."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from frobs_core.util.arrays import Floats

MAX_INPUT = 2_000
"""Maximum length of a message about keys and gamepads [characters]."""

MAX_PRESSES = 32
"""Maximum number of presses that are stored until they are read."""

TIMEOUT = 0.6
"""Time without a message after which the keys of a page count as released [s]. The page repeats them every 0.2 s."""

STICKS = 4
"""Number of axes of the two sticks of a gamepad."""

_DEAD_ZONE = 0.1
"""Deflection of a stick below which it counts as centered."""


@dataclass(frozen=True)
class _State:
    keys: frozenset[str]
    axes: tuple[float, ...]
    time: float


class Devices:
    """Keys that are pressed, and deflections of the sticks, on all pages together.

    A page sends its complete state if it changes, and repeats it while a key or stick is active. When the connection is
    closed, the window loses the focus, or the messages stop, everything is released.

    Args:
        clock: Function that returns the time [s].

    Attributes:
        wanted: Names of the keys that pages report, as in ``KeyboardEvent.code``. Pages ignore their usual meaning.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._states: dict[object, _State] = {}
        self._presses: deque[str] = deque(maxlen=MAX_PRESSES)
        self.wanted: frozenset[str] = frozenset()

    def receive(self, page: object, message: object) -> bool:
        """Store the state that a page sent, and return whether the message is valid."""
        try:
            if not isinstance(message, str) or len(message) > MAX_INPUT:
                return False
            state = json.loads(message)
            keys = frozenset(map(str, state["keys"])) | {f"button{int(each)}" for each in state["buttons"]}
            axes = tuple(float(each) for each in state["axes"][:STICKS])
        except (ValueError, TypeError, KeyError, RecursionError):
            return False
        if not np.isfinite(axes).all():
            return False
        before = self._states.get(page)
        self._states[page] = _State(keys & self.wanted, axes, self._clock())
        for key in sorted(self._states[page].keys - (before.keys if before else frozenset())):
            self._presses.append(key)
        return True

    def release(self, page: object) -> None:
        """Release everything on a page, whose connection is closed."""
        self._states.pop(page, None)

    def _live(self) -> list[_State]:
        oldest = self._clock() - TIMEOUT
        return [state for state in list(self._states.values()) if state.time >= oldest]

    def keys(self) -> frozenset[str]:
        """Return the names of all pressed keys and buttons, such as ``"KeyW"`` and ``"button0"``."""
        return frozenset().union(*(state.keys for state in self._live()))

    def axes(self) -> Floats:
        """Return the deflections of the sticks, (4,) in [−1, 1]: left x and y, right x and y; y points down."""
        found = np.zeros(STICKS)
        for state in self._live():
            given = np.clip(np.array([*state.axes, *[0.0] * STICKS][:STICKS]), -1.0, 1.0)
            found = np.where(np.abs(given) > np.maximum(np.abs(found), _DEAD_ZONE), given, found)
        return found

    def presses(self) -> list[str]:
        """Return the names of the keys and buttons that were pressed since the last call, in order."""
        return [self._presses.popleft() for _ in range(len(self._presses))]


def with_script(page: bytes) -> bytes:
    """Return an HTML page with the script that sends keys and gamepads."""
    script = files("frobs_view").joinpath("input.js").read_bytes()
    return page.replace(b"<head>", b"<head>\n<script>\n" + script + b"</script>", 1)
