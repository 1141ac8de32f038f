"""Bridge that runs a world in a separate thread and schedules the world's components."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from frobs_ros.bridge import LOG
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.loop import Loop
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import NANO, World

_Result = TypeVar("_Result")
_LONGEST = 0.02  # maximum simulated time [s] between two checks for requests


class Bridge:
    """A running world and the components of its models.

    After the simulation thread has started, only this thread may use the world or call methods other than :meth:`call`.

    Args:
        make_components: Function that creates the components of a new model, such as plugins and a controller manager.

    Attributes:
        world: The simulated world.
        ode: ODE solver parameters (gazebo_msgs/ODEPhysics). The parameters are stored but have no effect on the
            simulation.
        lights: Properties of each light (gazebo_msgs/SetLightPropertiesRequest), by name. They have no effect on the
            simulation.
    """

    def __init__(
        self, world: World, *, paused: bool, make_components: Callable[[Bridge, Model], Sequence[Component]]
    ) -> None:
        self.world = world
        self.loop = Loop(self, paused)
        self._make_components = make_components
        self._general: list[Component] = []
        self._components: dict[str, list[Component]] = {}
        self.max_update_rate = 1000.0
        self.ode: Any = None
        self.lights: dict[str, Any] = {}

    @property
    def speed(self) -> float:
        """Maximum number of simulated seconds per wall-clock second, or 0 for no limit."""
        return max(0.0, self.max_update_rate) * self.world.timestep

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.world.time_ns / NANO

    def call(self, function: Callable[[], _Result]) -> _Result:
        """Run a function in the simulation thread and return its result."""
        return self.loop.call(function)

    def join(self, component: Component) -> None:
        """Add a component that does not belong to a model."""
        self._general.append(component)

    def add(self, model: Model) -> None:
        """Add a model and its plugins to the world."""
        self.world.add(model)
        try:
            self._components[model.name] = list(self._make_components(self, model))
        except BaseException:
            self.world.remove(model.name)
            raise

    def extend(self, name: str, components: Sequence[Component]) -> None:
        """Add components to an existing model."""
        self._components[name] += components

    def remove(self, name: str) -> None:
        """Remove a model and its plugins from the world."""
        self.world.model(name)
        for component in self._components.pop(name, []):
            component.close()
        self.world.remove(name)

    def step(self, steps: int) -> None:
        """Advance the simulation by a number of physics steps and publish all messages that become due.

        Raises:
            SimulationError: The engine failed.
        """
        goal = self.world.steps + steps
        while self.world.steps < goal:
            self._go(goal - self.world.steps)
        self.tell()

    def advance(self, most: float) -> None:
        """Advance the simulation by up to ``most`` seconds, rounded to whole physics steps, but by at least one step."""
        self._go(max(1, round(min(most, _LONGEST) / self.world.timestep)))

    def set_paused(self, paused: bool) -> None:
        """Pause or unpause simulated time."""
        self.loop.set_paused(paused)
        if paused:
            self.tell()

    def reset(self, *, time: bool) -> None:
        """Reset the world and all components."""
        self.world.reset(time=time)
        for component in self._active():
            component.reset(self.world)
        self.loop.keep_pace()
        self.tell()

    def tell(self) -> None:
        """Publish the time and the world's states, so that clients receive them even while the simulation is paused."""
        for component in self._general:
            component.publish(self.world)

    def fail(self, error: Exception) -> None:
        """Log the error that paused the simulation."""
        LOG.error("the simulation is paused because a step failed: %s", error, exc_info=error)

    def close(self) -> None:
        """Stop the simulation thread and unregister all topics. Further calls have no effect."""
        self.loop.close(self.world.close)  # OpenGL contexts must be released in the thread that renders
        for component in self._all():
            component.close()
        self._components.clear()
        self._general.clear()
        self.world.close()

    def _all(self) -> list[Component]:
        return [*self._general, *(component for components in self._components.values() for component in components)]

    def _active(self) -> list[Component]:
        return [active for component in self._all() for active in component.active()]

    def _go(self, most: int) -> None:
        """Advance by at most ``most`` steps, stop early if a component is due, and let all due components publish."""
        world, components = self.world, self._active()
        due = [time for component in components if (time := component.due_ns()) is not None]
        change = world.forces.next_change_ns(world.time_ns)
        steps = min([most, *(world.steps_until(time) for time in [*due, *([] if change is None else [change])])])
        for component in components:
            least = component.most_steps(world)
            steps = steps if least is None else min(steps, least)
        if any(model.joint_targets.needs_every_step for model in world.robots()):
            steps = 1
        for component in components:
            component.before(world, steps)
        world.step(steps)
        for component in components:
            component.after(world)
        for component in components:
            time = component.due_ns()
            if time is not None and time <= world.time_ns:
                component.publish(world)
