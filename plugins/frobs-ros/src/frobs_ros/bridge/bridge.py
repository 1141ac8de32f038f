"""The bridge: a world, the thread that owns it, and the schedule of its components."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from frobs_ros.bridge.component import Component
from frobs_ros.bridge.loop import Loop
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import NANO, World

_Result = TypeVar("_Result")
LOG = logging.getLogger("frobs.bridge")
_LONGEST = 0.02  # [s] of simulated time between two checks for requests


class Bridge:
    """A running world, with all components of its models.

    Args:
        furnish: Function that creates the components of a new model: its plugins and controllers.

    Attributes:
        world: Only the loop's thread may use it: through :meth:`call`.
        ode: Parameters of ODE's solver (gazebo_msgs/ODEPhysics), which are only stored, because no simulator of FRobs
            uses ODE.
    """

    def __init__(self, world: World, *, paused: bool, furnish: Callable[[Bridge, Model], Sequence[Component]]) -> None:
        self.world = world
        self.loop = Loop(self, paused)
        self._furnish = furnish
        self._general: list[Component] = []
        self._components: dict[str, list[Component]] = {}
        self.max_update_rate = 1000.0
        self.ode: Any = None

    @property
    def speed(self) -> float:
        """Simulated seconds per second; 0: unlimited."""
        return max(0.0, self.max_update_rate) * self.world.timestep

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.world.time_ns / NANO

    def call(self, function: Callable[[], _Result]) -> _Result:
        """Run a function in the loop's thread, and return its result."""
        return self.loop.call(function)

    def join(self, component: Component) -> None:
        """Add a component that does not belong to a model."""
        self._general.append(component)

    def add(self, model: Model) -> None:
        """Add a model to the world, with its plugins; in the loop's thread.

        Raises:
            ConfigurationError: A model with that name exists.
            ModelFileError: The simulator rejects the model.
        """
        self.world.add(model)
        try:
            self._components[model.name] = list(self._furnish(self, model))
        except BaseException:
            self.world.remove(model.name)
            raise

    def extend(self, name: str, components: Sequence[Component]) -> None:
        """Add components to an existing model."""
        self._components[name] += components

    def remove(self, name: str) -> None:
        """Remove a model from the world, with its plugins; in the loop's thread.

        Raises:
            UnknownNameError: There is no model with that name.
        """
        self.world.model(name)
        for component in self._components.pop(name, []):
            component.close()
        self.world.remove(name)

    def step(self, steps: int) -> None:
        """Advance by a number of physics steps, and publish in between; in the loop's thread.

        Raises:
            SimulationError: The engine failed.
        """
        goal = self.world.steps + steps
        while self.world.steps < goal:
            self._go(goal - self.world.steps)
        self.tell()

    def advance(self, most: float) -> None:
        """Advance by at least one step and about ``most`` [s] at most; called by the loop."""
        self._go(max(1, round(min(most, _LONGEST) / self.world.timestep)))

    def set_paused(self, paused: bool) -> None:
        """Pause or unpause the time; in the loop's thread."""
        self.loop.set_paused(paused)
        if paused:
            self.tell()

    def reset(self, *, time: bool) -> None:
        """Reset the world; in the loop's thread."""
        self.world.reset(time=time)
        for component in self._all():
            component.reset(self.world)
        self.loop.keep_pace()
        self.tell()

    def tell(self) -> None:
        """Publish the time, so that clients have it although it is paused."""
        for component in self._general:
            component.publish(self.world)

    def fail(self, error: Exception) -> None:
        """Log that a step failed; the loop is paused."""
        LOG.error("the simulation is paused because a step failed: %s", error, exc_info=error)

    def close(self) -> None:
        """End the loop and leave the ROS graph. Calling it again has no effect."""
        self.loop.close(self.world.close)  # OpenGL contexts belong to the thread that renders
        for component in self._all():
            component.close()
        self._components.clear()
        self._general.clear()
        self.world.close()

    def _all(self) -> list[Component]:
        return [*self._general, *(component for components in self._components.values() for component in components)]

    def _go(self, most: int) -> None:
        """Step until a component is due, at most ``most`` steps; then publish what is due."""
        world, components = self.world, self._all()
        due = [time for component in components if (time := component.due_ns()) is not None]
        change = world.forces.next_change_ns(world.time_ns)
        steps = min([most, *(world.steps_until(time) for time in [*due, *([] if change is None else [change])])])
        for component in components:
            least = component.most_steps(world)
            steps = steps if least is None else min(steps, least)
        if any(model.drive.needs_every_step for model in world.robots()):
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
