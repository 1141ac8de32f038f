"""An action server that does not depend on the simulated time going on, or forward."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def start_action_server(name: str, kind: Any, accept: Callable[[Any], None], cancel: Callable[[Any], None]) -> Any:
    """Start and return an ``actionlib.ActionServer``, which tells its status whenever that changes.

    Its timer is stopped: it runs by the simulated time, and dies where that goes back.

    Args:
        name: Of the action.
        kind: Its class.
        accept: Called with the handle of each goal.
        cancel: Called with the handle of a goal to be cancelled.
    """
    from actionlib import ActionServer

    server = ActionServer(name, kind, goal_cb=accept, cancel_cb=cancel, auto_start=False)
    server.start()
    server.status_timer.shutdown()
    return server
