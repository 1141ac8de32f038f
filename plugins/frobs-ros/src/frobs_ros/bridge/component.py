"""The base class of the bridge's components: when they publish, with empty defaults for optional methods."""

from __future__ import annotations

from typing import Any

from frobs_ros.bridge.world import NANO, World


class Component:
    """A component of the simulation: a publisher or a drive. Subclasses override the methods that they need.

    Only the loop's thread calls it.

    Args:
        rate: Publications per simulated second [Hz]; 0: none.
    """

    def __init__(self, rate: float = 0.0) -> None:
        self._period_ns = max(1, round(NANO / rate)) if rate > 0.0 else None
        self._next_ns = 0
        self._last_stamp_ns = -1
        self._topics: list[Any] = []

    def own(self, topic: Any) -> Any:
        """Register a publisher or subscriber, which :meth:`close` unregisters, and return it."""
        self._topics.append(topic)
        return topic

    def next_stamp(self, world: World) -> Any:
        """Return a stamp for the current time as a ``rospy.Time``, unique until :meth:`reset`."""
        self._last_stamp_ns = max(world.time_ns, self._last_stamp_ns + 1)
        return stamp(self._last_stamp_ns)

    def publish_no_more(self) -> None:
        """Stop publishing for good."""
        self._period_ns = None

    def before(self, world: World, steps: int) -> None:
        """Set the drives' targets for the next physics steps."""

    def most_steps(self, world: World) -> int | None:
        """Return how many steps it can look ahead; None: any number."""
        return None

    def due_ns(self) -> int | None:
        """Return when :meth:`publish` is due [ns]; None: never."""
        return None if self._period_ns is None else self._next_ns

    def publish(self, world: World) -> None:
        """Publish if due, and set the next time."""
        if self._period_ns is not None:
            # On a grid, so that rates which are not multiples of each other coincide if possible.
            self._next_ns = (world.time_ns // self._period_ns + 1) * self._period_ns
        self.tell(world)

    def tell(self, world: World) -> None:
        """Publish."""

    def after(self, world: World) -> None:
        """Read the state after the steps."""

    def reset(self, world: World) -> None:
        """Reset the component, because models, and possibly the time, were reset."""
        self._next_ns = world.time_ns
        self._last_stamp_ns = -1

    def close(self) -> None:
        """Leave the ROS graph."""
        for topic in self._topics:
            topic.unregister()


def stamp(time_ns: int) -> Any:
    """Return simulated time as a ``rospy.Time``."""
    import rospy

    return rospy.Time(*divmod(time_ns, NANO))
