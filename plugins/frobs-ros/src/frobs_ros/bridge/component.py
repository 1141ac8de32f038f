"""Base class of the bridge's components. It schedules publishing and has empty defaults for optional methods."""

from __future__ import annotations

from typing import Any

from frobs_ros.bridge.world import NANO, World


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

    def own(self, topic: Any) -> Any:
        """Return the given publisher or subscriber, and store it so that :meth:`close` unregisters it."""
        self._topics.append(topic)
        return topic

    def next_stamp(self, world: World) -> Any:
        """Return a ``rospy.Time`` stamp for the current time. All stamps are unique until :meth:`reset` is called."""
        self._last_stamp_ns = max(world.time_ns, self._last_stamp_ns + 1)
        return stamp(self._last_stamp_ns)

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
