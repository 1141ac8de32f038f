"""A world whose models can be added and removed during a simulation. Only one thread at a time may use a world."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import numpy as np

from frobs_core.contracts import Simulation
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, ParameterValueError, UnknownNameError, check_name
from frobs_ros.bridge.forces import Forces
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import REST, WORLD, Motion, Place
from frobs_ros.bridge.scene import Touches, find_touches, make_scene

NANO = 1_000_000_000


class World:
    """A simulated world with its models, the forces on the models, and the simulated time.

    Adding or removing a model, or changing the time step, creates a new simulation, in which the remaining models keep
    their state.

    Args:
        timestep: Duration of a physics step [s].
        gravity: [m/s²]
        floor: Whether the world has a ground plane at z = 0.

    Attributes:
        gravity: [m/s²]
        has_floor: Whether the world has a ground plane.
        time_ns: Simulated time since the start or the last time reset [ns].
        steps: Number of physics steps since the start.
        touches: Measured contact pairs of each link that has a contact sensor, keyed by model name and link name.
    """

    def __init__(
        self,
        simulator: SimulatorRecord,
        *,
        timestep: float = 0.001,
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.8),
        floor: bool = True,
    ) -> None:
        self._simulator, self.has_floor = simulator, floor
        self._timestep, self.gravity = _checked(timestep), gravity
        self._parameters: dict[tuple[str, str], Floats] = {}
        self._viewed = False
        self.simulation: Simulation | None = None
        self.models: dict[str, Model] = {}
        self.forces = Forces()
        self.touches: Touches = {}
        self.time_ns = 0
        self.steps = 0

    @property
    def timestep(self) -> float:
        """Duration of a physics step [s]."""
        return self._timestep

    @property
    def timestep_ns(self) -> int:
        """Duration of a physics step [ns]."""
        return round(self._timestep * NANO)

    def robots(self) -> Iterator[Model]:
        """Yield the models that are not static."""
        return (model for model in self.models.values() if model.robot is not None)

    def add(self, model: Model) -> None:
        """Add a model to the world. If an error is raised, the world remains unchanged.

        Raises:
            ConfigurationError: A model with that name exists.
            ModelFileError: The simulator rejects the model.
        """
        if model.name in self.models:
            raise ConfigurationError(f"the world already contains a model named '{model.name}'; choose another name.")
        model.key = self._free_key(model.name)
        self._build([*self.models.values(), model])
        self.models[model.name] = model
        if model.robot is not None:
            model.joint_targets.hold(model.robot)

    def remove(self, name: str) -> Model:
        """Remove a model from the world and return the model."""
        model = self.model(name)
        self._build([other for other in self.models.values() if other is not model])
        del self.models[name]
        model.robot = None
        self.forces.remove(name)
        for key in [key for key in self._parameters if key[1].partition("/")[0] == model.key]:
            del self._parameters[key]
        return model

    def model(self, name: str) -> Model:
        """Return a model.

        Raises:
            UnknownNameError: The world contains no model with this name.
        """
        check_name("model", name, self.models)
        return self.models[name]

    def set_timestep(self, timestep: float) -> None:
        """Change the duration of a physics step [s].

        Raises:
            ConfigurationError: The duration is not in (0, 1) s or rounds to 0 ns.
        """
        if _checked(timestep) != self._timestep:
            self._timestep = timestep
            self._build(list(self.models.values()))

    def set_gravity(self, gravity: tuple[float, float, float]) -> None:
        """Change the gravity [m/s²]."""
        if gravity != self.gravity:
            self.gravity = gravity
            if self.simulation is not None:
                self.simulation.write_parameter("gravity", "", np.array([gravity], np.float64))

    def parameter(self, name: str, target: str) -> Floats:
        """Return a physical parameter. The world must contain a simulated model."""
        assert self.simulation is not None
        return self.simulation.parameter(name, target)

    def write_parameter(self, name: str, target: str, values: Floats) -> None:
        """Change a physical parameter. The value is kept when other models are added or removed."""
        assert self.simulation is not None
        self.simulation.write_parameter(name, target, values)
        self._parameters[name, target] = values

    def can(self, capability: str) -> bool:
        """Return whether the simulator has a capability."""
        return bool(self._simulator.capabilities.get(capability))

    def put(self, model: Model, place: Place, motion: Motion = REST) -> None:
        """Teleport a model."""
        was = model.place()
        model.put(place, motion)
        if model.is_static and model.has_camera and not all(map(np.array_equal, was, place)):
            self._build(self.models.values())  # a static camera cannot be moved
        elif self.simulation is not None:
            for name, body in model.static_bodies().items():
                self.simulation.bodies[name].write_pose(np.array([body.pose.pos]), np.array([body.pose.quat_wxyz]))

    def step(self, steps: int) -> None:
        """Advance the world by a number of physics steps, with the joint targets that the controllers have set.

        Raises:
            SimulationError: The engine failed.
        """
        if self.simulation is not None:
            self.forces.apply(self)
            for model in self.robots():
                model.joint_targets.command(model.handle, steps, self._timestep)
            self.simulation.step(steps)
        self.steps += steps
        self.time_ns += steps * self.timestep_ns

    def steps_until(self, time_ns: int) -> int:
        """Return the number of physics steps until a given time, at least 1."""
        return max(1, -(-(time_ns - self.time_ns) // self.timestep_ns))

    def reset(self, *, time: bool) -> None:
        """Reset all models to their spawn poses at rest, clear all forces, and reset the time if ``time`` is True."""
        if self.simulation is not None:
            self.simulation.reset()
        self.forces.clear()
        for model in self.models.values():
            self.put(model, model.spawned)
            if model.robot is not None:
                model.joint_targets.hold(model.robot)
        if time:
            self.time_ns = 0

    def find_link(self, name: str) -> tuple[Model, str]:
        """Return the model and the link for a scoped name, ``"model::link"``, or for a unique link name.

        Raises:
            UnknownNameError: No link or more than one link has this name.
        """
        return self._find("link", name, {model.name: model.links for model in self.models.values()})

    def find_joint(self, name: str) -> tuple[Model, str]:
        """Return the model and the actuated joint for a scoped name, ``"model::joint"``, or for a unique joint name.

        Raises:
            UnknownNameError: No joint or more than one joint has this name.
        """
        return self._find("joint", name, {model.name: tuple(model.joints) for model in self.models.values()})

    def frame(self, name: str) -> tuple[Place, Motion]:
        """Return the pose and velocity of a frame: the world, a model or a link.

        Raises:
            UnknownNameError: The frame does not exist.
        """
        if name in ("", "world", "map", "/map"):
            return WORLD, REST
        if name in self.models:
            return self.models[name].place(), self.models[name].motion()
        model, link = self.find_link(name)
        return model.link_place(link), model.link_motion(link)

    def open_viewer(self) -> None:
        """Open a viewer window, which is reopened whenever a new simulation is created."""
        self._viewed = True
        if self.simulation is not None:
            self.simulation.open_viewer()

    def close(self) -> None:
        """Release the simulation. Further calls have no effect."""
        if self.simulation is not None:
            self.simulation.close()
            # Break reference cycles, so that memory is freed immediately and repeated spawns do not fragment it.
            self.simulation.robots, self.simulation.bodies = {}, {}
            self.simulation = None

    def _find(self, kind: str, name: str, names: dict[str, tuple[str, ...]]) -> tuple[Model, str]:
        owner, scoped, inner = name.partition("::")
        inner = inner.rpartition("::")[2] if scoped else name
        owners = [owner] if scoped else list(names)
        matches = [model for model in owners if inner in names.get(model, ())]
        if len(matches) != 1:
            raise UnknownNameError(
                kind, name, [f"{model}::{each}" for model, all_of in names.items() for each in all_of]
            )
        return self.models[matches[0]], inner

    def _free_key(self, name: str) -> str:
        """Return a unique name for a model in the simulation, without special characters or reserved words."""
        taken = {model.key for model in self.models.values()} | {"world", "floor"}
        key = base = re.sub(r"\W", "_", name) or "model"
        number = 2
        while key in taken:
            key, number = f"{base}_{number}", number + 1
        return key

    def _build(self, models: Iterable[Model]) -> None:
        """Create a new simulation of the models, in which existing models keep their state."""
        models = list(models)
        moving = [model for model in models if not model.is_static]
        # Some simulators hide only the first few robots from their own lidars, so add robots with a lidar first.
        moving.sort(key=lambda model: not (model.description.placement and model.description.placement.robot.lidars))
        states = {model.name: model.state() for model in moving if model.robot is not None}
        new: Simulation | None = None
        touches = find_touches(models, floor=self.has_floor) if self.can("contacts") else {}
        if moving or (self.can("cameras") and any(model.has_camera for model in models)):
            scene = make_scene(
                models, touches, floor=self.has_floor, gravity=self.gravity, with_cameras=self.can("cameras")
            )
            robots = {model.key: model.placement() for model in moving}
            new = self._simulator.load()(robots, scene, num_envs=1, physics_timestep=self._timestep, num_threads=1)
        self.close()
        self.simulation, self.touches = new, touches
        for model in moving:
            assert new is not None
            model.robot = new.robots[model.key]
            if model.name in states:
                model.write_state(*states[model.name])
        for (name, target), values in self._parameters.items():
            if new is not None and target.partition("/")[0] in new.robots:
                new.write_parameter(name, target, values)
        if self._viewed and new is not None:
            new.open_viewer()


def _checked(timestep: float) -> float:
    if not 0.0 < timestep < 1.0 or round(timestep * NANO) < 1:
        raise ParameterValueError("time step", timestep, "in (0, 1) [s]")
    return timestep
