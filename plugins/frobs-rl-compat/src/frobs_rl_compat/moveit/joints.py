"""The current positions of a robot's joints, from the topic ``joint_states``."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from functools import cache
from typing import Any

from frobs_rl_compat.moveit.errors import MoveItCommanderException
from frobs_rl_compat.moveit.node import resolve

_PAUSED = 0.1  # [s] time without a message after which the simulation is considered paused


class JointStates:
    """Subscribes to a topic of joint states and stores the current positions."""

    def __init__(self, topic: str) -> None:
        import rospy
        from sensor_msgs.msg import JointState

        self._topic = topic
        self._positions: dict[str, float] = {}
        self._count, self._stamp = 0, 0.0
        self._changed = threading.Condition()
        self._listener = rospy.Subscriber(topic, JointState, self._take, queue_size=1, tcp_nodelay=True)

    def _take(self, message: Any) -> None:
        with self._changed:
            self._positions.update(zip(message.name, message.position, strict=False))
            self._stamp = message.header.stamp.to_sec()
            self._count += 1
            self._changed.notify_all()

    @property
    def stamp(self) -> float:
        """Time of the last message, on the robot's clock [s]."""
        return self._stamp

    def current(self, names: Iterable[str], wait: float = 1.0, since: float = 0.0) -> dict[str, float]:
        """Return joint positions from the next message, or from the last message if the simulation is paused.

        Messages that were stamped before this call or before ``since`` are skipped, because on a busy computer a message
        may arrive long after its positions were measured. Messages without a stamp are never skipped.

        Args:
            names: Names of the joints.
            wait: Maximum time to wait [s].
            since: Earliest time of the positions on the robot's clock [s], such as the end of a motion.
        """
        import rospy

        requested, since = list(names), max(since, rospy.get_time())
        with self._changed:
            count, end = self._count, time.monotonic() + wait
            while not (known := self._is_known(requested)) or self._count == count or 0.0 < self._stamp < since:
                remaining = end - time.monotonic()
                received = self._changed.wait(min(_PAUSED, remaining) if known else remaining)
                if not received and (known or remaining <= 0.0):  # the simulation is paused, or the time is over
                    break
            missing = [name for name in requested if name not in self._positions]
            if missing:
                raise MoveItCommanderException(
                    f"the topic {self._topic} provided no position of {', '.join(missing)} within {wait:g} s; start "
                    "the joint_state_controller, and unpause the simulation."
                )
            return {name: self._positions[name] for name in requested}

    def _is_known(self, names: Iterable[str]) -> bool:
        return all(name in self._positions for name in names)


@cache
def _listen(topic: str) -> JointStates:
    return JointStates(topic)


def joint_states(namespace: str) -> JointStates:
    """Return the joint states of a namespace. Calls for the same topic share one subscriber."""
    return _listen(resolve(namespace, "joint_states"))
