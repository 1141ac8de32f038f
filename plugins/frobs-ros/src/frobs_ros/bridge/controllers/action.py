"""An action server that does not depend on the simulated time going on, or forward."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

STATUS_FREQUENCY = "/gazebo/actionlib_status_frequency"
"""Parameter of the node with which actionlib starts no timer: it would run by the simulated time, and die where that
goes back."""


class _NoTimer:
    """Stands where actionlib expects its timer when it is stopped."""

    def shutdown(self) -> None:
        """Do nothing."""


def start_action_server(name: str, kind: Any, accept: Callable[[Any], None], cancel: Callable[[Any], None]) -> Any:
    """Start and return an ``actionlib.ActionServer``, which tells its status whenever that changes."""
    import rospy
    from actionlib import ActionServer

    rospy.set_param(STATUS_FREQUENCY, 0)
    server = ActionServer(name, kind, goal_cb=accept, cancel_cb=cancel, auto_start=False)
    server.status_timer = _NoTimer()
    server.start()
    return server
