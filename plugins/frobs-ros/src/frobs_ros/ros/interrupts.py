"""Handles Ctrl-C in scripts that are ROS nodes.

rospy's signal handler shuts the node down in the main thread, at an arbitrary point. rospy's handler can wait forever
for a lock that the main thread itself holds, and prints a traceback if the signal arrives while a log line is written.
The handler in this module shuts the node down in another thread.

Like rospy's handler, this handler does not raise KeyboardInterrupt. Therefore, a script that never checks
``rospy.is_shutdown()``, such as a training script, would continue after its node was shut down. :func:`interruptible`
ends such a script.
"""

from __future__ import annotations

import _thread
import contextlib
from collections.abc import Iterator
from typing import Any

_was_interrupted = False


def watch() -> None:
    """Make ``rospy.init_node`` install the signal handler of this module instead of rospy's own handler."""
    import rospy.core

    rospy.core._ros_signal = _shut_down


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """If a signal has shut down the node, raise KeyboardInterrupt instead of any errors that the shutdown causes.

    Raises:
        KeyboardInterrupt: A signal, such as SIGINT from Ctrl-C, has shut down the node.
    """
    if _was_interrupted:
        raise KeyboardInterrupt
    try:
        yield
    except Exception:
        if _was_interrupted:
            raise KeyboardInterrupt from None
        raise


def _shut_down(number: int, frame: Any) -> None:
    global _was_interrupted
    import rospy.core

    _was_interrupted = True
    # Thread.start would acquire a lock that the main thread may hold.
    _thread.start_new_thread(rospy.core.signal_shutdown, (f"signal-{number}",))
    previous = rospy.core._signalChain.get(number)
    if callable(previous):
        with contextlib.suppress(KeyboardInterrupt):
            previous(number, frame)
