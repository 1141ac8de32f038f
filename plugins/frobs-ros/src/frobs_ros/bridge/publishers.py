"""Topics for the whole world: the clock, model and link states, and commands that set states."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from frobs_core.util.errors import FrobsError
from frobs_ros.bridge import LOG
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.component import Component, stamp
from frobs_ros.bridge.poses import Motion, Place, pose_message, twist_message
from frobs_ros.bridge.services.links import set_link_state
from frobs_ros.bridge.services.models import set_model_state
from frobs_ros.bridge.world import NANO, World


class Clock(Component):
    """Publisher of ``/clock``, which sets the bridge node's own time directly instead of through a socket."""

    def __init__(self, rate: float) -> None:
        import rospy
        from rospy.impl import simtime

        super().__init__(rate or NANO)  # 0 selects 1 GHz, so that a message is due after every physics step
        self._published_ns: int | None = None
        self._publisher = self.publisher("/clock", "rosgraph_msgs/Clock", queue_size=10, latch=True)
        self._set_own: Callable[[Any], None] | None = None
        if getattr(simtime, "_clock_sub", None) is not None:
            simtime._clock_sub.unregister()
            self._set_own = rospy.rostime._set_rostime

    def tell(self, world: World) -> None:
        """Publish the time if it has changed."""
        if world.time_ns == self._published_ns:
            return
        self._published_ns = world.time_ns
        now = stamp(world.time_ns)
        if self._set_own is not None:
            self._set_own(now)
        self._publisher.publish(now)


class States(Component):
    """Publisher of ``/gazebo/model_states`` and ``/gazebo/link_states``, which skips topics without subscribers."""

    def __init__(self, rate: float) -> None:
        super().__init__(rate)
        self._models = self.publisher("/gazebo/model_states", "gazebo_msgs/ModelStates")
        self._links = self.publisher("/gazebo/link_states", "gazebo_msgs/LinkStates")

    def tell(self, world: World) -> None:
        if self._models.get_num_connections():
            models = world.models.values()
            self._send(self._models, [(model.name, model.place(), model.motion()) for model in models])
        if self._links.get_num_connections():
            links = [(model, link) for model in world.models.values() for link in model.links]
            rows = [(f"{model.name}::{link}", model.link_place(link), model.link_motion(link)) for model, link in links]
            self._send(self._links, rows)

    @staticmethod
    def _send(publisher: Any, rows: Iterable[tuple[str, Place, Motion]]) -> None:
        message = publisher.data_class()
        for name, place, motion in rows:
            message.name.append(name)
            message.pose.append(pose_message(place))
            message.twist.append(twist_message(motion))
        publisher.publish(message)


class StateCommands(Component):
    """Subscriber to the topics ``/gazebo/set_model_state`` and ``/gazebo/set_link_state``.

    These topics have the same effect as the services of the same names.
    """

    def __init__(self, bridge: Bridge) -> None:
        super().__init__()
        self._bridge = bridge
        for kind, act in (("ModelState", set_model_state), ("LinkState", set_link_state)):
            topic, message = f"/gazebo/{act.__name__}", f"gazebo_msgs/{kind}"
            self.subscribe(topic, message, partial(self._obey, act), queue_size=10)

    def _obey(self, act: Callable[[Bridge, Any], Any], message: Any) -> None:
        try:
            self._bridge.call(lambda: act(self._bridge, message))
        except FrobsError as error:
            LOG.warning("%s", error)
