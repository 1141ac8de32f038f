"""Ctrl-C in scripts that are ROS nodes.

rospy's handler shuts the node down and swallows the KeyboardInterrupt, so that a script which never asks
``rospy.is_shutdown()``, such as a training script, would go on without its node.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

_was_interrupted = False


def watch() -> None:
    """Notice when a signal shuts this process's node down."""
    import rospy

    rospy.core.add_preshutdown_hook(_note)


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Raise KeyboardInterrupt inside if a signal has shut the node down, also in place of the errors that follow from it.

    Raises:
        KeyboardInterrupt: A signal, such as that of Ctrl-C, has shut the node down.
    """
    if _was_interrupted:
        raise KeyboardInterrupt
    try:
        yield
    except Exception:
        if _was_interrupted:
            raise KeyboardInterrupt from None
        raise


def _note(reason: str) -> None:
    global _was_interrupted
    _was_interrupted = _was_interrupted or reason.startswith("signal-")
