"""Base class of the bridge's components. It schedules publishing and has empty defaults for optional methods."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from frobs_ros.bridge.world import NANO, World
from frobs_ros.messages.types import find_type


class Component:
    """A component of the simulation, such as a publisher or a drive. Subclasses override the methods that they need.

    Only the simulation thread calls the methods of a component.

    Args:
        rate: Publishing rate in simulated time [Hz], or 0 to disable periodic publishing.
    """

    def __init__(self, rate: float = 0.0) -> None:
        self._period_ns = max(1, round(NANO / rate)) if rate > 0.0 else None
        self._next_ns = 0
        self._last_stamp_ns = -1
        self._topics: list[Any] = []

    def publisher(self, topic: str, kind: str, queue_size: int = 1, *, latch: bool = False) -> Any:
        """Return a publisher of messages of a type such as ``"nav_msgs/Odometry"``, until :meth:`close` is called."""
        import rospy

        message = find_type(kind)
        self._topics.append(rospy.Publisher(topic, message, queue_size=queue_size, latch=latch, tcp_nodelay=True))
        return self._topics[-1]

    def subscribe(self, topic: str, kind: str, callback: Callable[[Any], None], queue_size: int = 1) -> None:
        """Call a function with each message of a type such as ``"nav_msgs/Odometry"``, until :meth:`close` is called."""
        import rospy

        message = find_type(kind)
        self._topics.append(rospy.Subscriber(topic, message, callback, queue_size=queue_size, tcp_nodelay=True))

    def header(self, world: World, frame: str = "") -> Any:
        """Return a ``std_msgs/Header`` for the current time. All stamps are unique until :meth:`reset` is called."""
        self._last_stamp_ns = max(world.time_ns, self._last_stamp_ns + 1)
        return find_type("std_msgs/Header")(stamp=stamp(self._last_stamp_ns), frame_id=frame)

    def active(self) -> Iterable[Component]:
        """Return the components that run: this component, or the running members of a group."""
        return (self,)

    def publish_no_more(self) -> None:
        """Stop publishing permanently."""
        self._period_ns = None

    def before(self, world: World, steps: int) -> None:
        """Set the drives' targets for the next physics steps."""

    def most_steps(self, world: World) -> int | None:
        """Return the maximum number of steps until the next call of :meth:`before`, or None for no limit."""
        return None

    def due_ns(self) -> int | None:
        """Return the simulated time at which :meth:`publish` is next due [ns], or None if it is never due."""
        return None if self._period_ns is None else self._next_ns

    def publish(self, world: World) -> None:
        """Publish now and schedule the next publication."""
        if self._period_ns is not None:
            # Publish at multiples of the period, so that the publishing times of components coincide where possible.
            self._next_ns = (world.time_ns // self._period_ns + 1) * self._period_ns
        self.tell(world)

    def tell(self, world: World) -> None:
        """Publish."""

    def after(self, world: World) -> None:
        """Read the simulation state after the physics steps."""

    def reset(self, world: World) -> None:
        """Reset the component after the models and possibly the time have been reset."""
        self._next_ns = world.time_ns
        self._last_stamp_ns = -1

    def close(self) -> None:
        """Unregister all publishers and subscribers."""
        for topic in self._topics:
            topic.unregister()


def stamp(time_ns: int) -> Any:
    """Convert a simulated time in nanoseconds to a ``rospy.Time``."""
    import rospy

    return rospy.Time(*divmod(time_ns, NANO))
