"""A simulation: ``num_envs`` copies of robots and a scene, advanced by an engine.

Arrays are batched, (num_envs, …), float64. An array that is read is current, read-only, and valid until the
next ``reset``, ``step``, ``write_…`` or ``restore``; copy what is to be kept. Masks are (num_envs,) bool, and
None means all environments. A value that is written is (n, …) for the n environments of the mask, in
their order, or broadcasts to it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Protocol, TypeAlias

import numpy as np

from frobs_core.arrays import Floats, Mask, read_only
from frobs_core.errors import CapabilityError, UnknownNameError
from frobs_core.interfaces.body_handle import BodyHandle
from frobs_core.interfaces.contacts import ContactState
from frobs_core.interfaces.pacing import Pacer
from frobs_core.interfaces.robot_handle import RobotHandle
from frobs_core.interfaces.scene import Marker, Placement, Scene
from frobs_core.interfaces.translation import Overlap, Translation
from frobs_core.models.model import RobotModel

Snapshot: TypeAlias = dict[str, np.ndarray[Any, Any]]
"""A complete state: arrays by name, each (num_envs, …)."""


Wrench: TypeAlias = tuple[str, Floats, Floats, Mask | None]
"""Arguments of :meth:`Simulation.apply_wrench`."""


class BareEngine(Protocol):
    """The tightest loop over an engine that its users would write, to compare with."""

    def load(self, snapshot: Snapshot) -> None:
        """Take the state and the controls of a simulation's snapshot."""

    def step(self, decimation: int) -> None:
        """Advance by ``decimation`` physics steps."""

    def rays(self, origins: Floats, directions: Floats, max_range: float) -> None:
        """Cast rays; the arguments are those of :meth:`Simulation.rays`. What they meet is of no interest."""


class Simulation(ABC):
    """``num_envs`` copies of robots and a scene.

    A simulator that lacks a capability leaves its methods out: they raise :class:`~frobs_core.errors.CapabilityError`.

    Further keyword-only parameters of a constructor are options of the simulator. Users give them to the environment as
    ``simulator_kwargs``, and ``frobs show`` lists them with the text of the class's docstring.

    Args:
        robots: By name; the environment's own is ``"robot"``.
        scene: Everything else. (Its ``robots`` have been merged into the first argument.)
        num_envs: ≥ 1.
        physics_timestep: [s]
        num_threads: For the engine; 0: one for each processor.

    Attributes:
        num_envs: Environments.
        physics_timestep: [s]
        robots: A handle for each robot.
        bodies: A handle for each body of the scene.
        contacts: The contacts that the scene declares; None: the simulator has none.
        pacer: The clock of a paced simulator, which has the ability ``real_time``; None: time passes in ``step`` alone.
        render_modalities: What ``render`` can draw.
        wrenches: Those that act in the next ``step``; simulators with the ability ``wrench`` keep a list of them.
        state: Every array that changes, by name; ``snapshot`` and ``restore`` then copy them. None: the simulator overrides
            both, or lacks the ability ``snapshot``.
        sensor_wrenches: Readings of the force-torque sensors, (num_envs, 6) each, by ``"robot/sensor"``, one for each of
            :attr:`Placement.force_torque_sensors`; None: the simulator has none.
    """

    render_modalities: ClassVar[Sequence[str]] = ("rgb", "depth", "segmentation")

    wrenches: Sequence[Wrench] = ()
    num_envs: int
    physics_timestep: float
    robots: Mapping[str, RobotHandle]
    bodies: Mapping[str, BodyHandle]
    contacts: ContactState | None = None
    pacer: Pacer | None = None
    sensor_wrenches: Mapping[str, Floats] | None = None
    state: Snapshot | None = None

    @abstractmethod
    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
    ) -> None: ...

    @classmethod
    def translation(cls, model: RobotModel) -> Sequence[Translation]:
        """Say what becomes of a robot's model file; ``frobs doctor robot`` shows it. No simulation is built for it.

        Args:
            model: The robot.

        Returns:
            At least one row for each of ``frobs_core.models.elements(model)``; what is left out is shown as not told.
        """
        return ()

    @property
    def native(self) -> Any:
        """The engine's own objects, if there are any; a task that uses them is tied to this simulator."""
        return None

    @property
    @abstractmethod
    def time(self) -> Floats:
        """(num_envs,) [s] since the reset."""

    @property
    def diverged(self) -> Mask | None:
        """Which environments the engine gave up on since their reset, or None while there are none."""
        return None

    @abstractmethod
    def reset(self, mask: Mask | None = None) -> None:
        """Go back to the scene as it was built: robots at home and at rest, drives holding, time 0.

        Physical parameters that were written stay. A paced simulator drives the robots home, and returns when they are
        there and at rest; bodies stay where they are.

        Raises:
            SimulationError: The robots of a paced simulator did not get home in time.
        """

    def step_with(self, decimation: int, update: Callable[[], None]) -> None:
        """Advance like :meth:`step`, with a function that is called before each physics step but the first.

        The function may read the state and command robots. Wrenches that were applied last through all physics steps, and
        contacts and force-torque sensors are afterwards those of the whole control step.

        Args:
            decimation: Physics steps.
            update: The function.
        """
        contacts, wrenches = [], list(self.wrenches)
        sensed = self.sensor_wrenches or {}
        means = {name: np.zeros_like(read) for name, read in sensed.items()}
        for i in range(decimation):
            if i:
                update()
                for wrench in wrenches:
                    self.apply_wrench(*wrench)
            self.step(1)
            if self.contacts is not None:
                contacts.append(self.contacts.snapshot())
            for name, read in sensed.items():
                means[name] += read / decimation
        if self.contacts is not None:
            self.contacts.merge(contacts)
        for name, read in sensed.items():
            read[:] = means[name]

    @abstractmethod
    def step(self, decimation: int) -> None:
        """Advance every environment by ``decimation`` physics steps. What is read afterwards is current.

        An environment that diverges stops where it is and shows in :attr:`diverged`; the others go on. A paced simulator
        waits with its :attr:`pacer` until the world has moved on.

        Raises:
            SimulationError: The engine failed as a whole.
        """

    def contact(self, name: str) -> Mask:
        """(num_envs,) bool: whether a contact that the scene declares was there in any physics step of the last ``step``.

        After a reset there is none, until the next ``step``.

        Raises:
            UnknownNameError: The scene declares no such contact.
        """
        contacts = self._contacts()
        return read_only(contacts.closed[:, contacts.scene.contact_number(name)])

    def contact_force(self, name: str) -> Floats:
        """(num_envs,) [N]: largest normal force of a declared contact in the last ``step``.

        Raises:
            UnknownNameError: The scene declares no such contact.
            ConfigurationError: The contact ignores something, so that its force is not told.
        """
        contacts = self._contacts()
        return read_only(contacts.normal_force[:, contacts.scene.contact_number(name, force=True)])

    def contact_resultant(self, name: str) -> Floats:
        """(num_envs, 3) [N]: total force on the first side of a declared contact, in the world, friction included.

        It is averaged over the physics steps of the last ``step``. Forces between two parts of the first side cancel.

        Raises:
            UnknownNameError: The scene declares no such contact.
            ConfigurationError: The contact ignores something, so that its force is not available.
        """
        contacts = self._contacts()
        return read_only(contacts.resultant[:, contacts.scene.contact_number(name, force=True)])

    def _contacts(self) -> ContactState:
        if self.contacts is None:
            raise CapabilityError.lacking(self, "contacts")
        return self.contacts

    def sensor_wrench(self, robot: str, sensor: str) -> Floats:
        """Return what a force-torque sensor reads, (num_envs, 6): force [N] and torque [N·m] in the frame of the sensor.

        It is the wrench that the parent exerts on the child, averaged over the physics steps of the last ``step``; 0 after
        a reset. See :class:`~frobs_core.interfaces.ForceTorque`.

        Args:
            robot: Name of the robot in the simulation.
            sensor: Name of the sensor.

        Raises:
            CapabilityError: The simulator lacks the ability ``force_torque``.
            UnknownNameError: The robot has no such force-torque sensor.
        """
        if self.sensor_wrenches is None:
            raise CapabilityError.lacking(self, "force_torque")
        name = f"{robot}/{sensor}"
        if name not in self.sensor_wrenches:
            raise UnknownNameError("force-torque sensor", name, self.sensor_wrenches)
        return read_only(self.sensor_wrenches[name])

    def rays(self, origins: Floats, directions: Floats, max_range: float) -> Floats:
        """Cast rays.

        Args:
            origins: (num_envs, k, 3) [m]
            directions: (num_envs, k, 3), of length 1.
            max_range: [m]

        Returns:
            (num_envs, k) [m]; ``max_range`` where nothing is hit.
        """
        raise CapabilityError.lacking(self, "rays")

    def write_body_poses(
        self, names: Sequence[str], pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None
    ) -> None:
        """Put several bodies somewhere at once, as :meth:`BodyHandle.write_pose` does one; quicker, where there are many.

        Args:
            names: Of k scene bodies.
            pos: (n, k, 3) [m]
            quat_wxyz: (n, k, 4); None: as they are.
            mask: The environments.

        Raises:
            SimulationError: A body is static.
        """
        for i, name in enumerate(names):
            self.bodies[name].write_pose(pos[:, i], None if quat_wxyz is None else quat_wxyz[:, i], mask)

    def apply_wrench(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> None:
        """Push a body at its centre of mass during the next ``step``, then no more.

        Args:
            body: A scene body, or ``"robot/link"``.
            force_world: (n, 3) [N]
            torque_world: (n, 3) [N·m]
            mask: The environments.
        """
        raise CapabilityError.lacking(self, "wrench")

    def parameter(self, name: str, target: str = "") -> Floats:
        """Return a physical parameter of each environment.

        Args:
            name: ``mass`` [kg] (num_envs,), with which the inertia goes; ``friction`` (num_envs,); ``size`` (num_envs,) a
                factor of all lengths of a body, which keeps its mass; ``stiffness`` and ``damping`` (drive gains) and
                ``joint_damping`` (num_envs, dof), ``gravity`` [m/s²] (num_envs, 3).
            target: For mass and friction a scene body or ``"robot/link"`` (friction also ``"floor"``); for size a scene
                body; for the joint parameters a robot's name; for gravity ``""``.

        Raises:
            UnknownNameError: No such parameter or target.
        """
        raise UnknownNameError("parameter", name, ())

    def parameter_targets(self, name: str) -> Sequence[str]:
        """Return the targets of ``size``, or of a parameter that a plugin has added.

        :meth:`parameter` returns (num_envs,) for each.
        """
        return ()

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> None:
        """Change a physical parameter; the arguments are those of :meth:`parameter`."""
        raise UnknownNameError("parameter", name, ())

    def snapshot(self) -> Snapshot:
        """Return the complete state: restored, it continues exactly, where the capability says so.

        Raises:
            CapabilityError: The simulator lacks the ability ``snapshot``.
        """
        return {name: array.copy() for name, array in self._state().items()}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot of this simulation or of one that was built alike."""
        for name, array in self._state().items():
            array[...] = snapshot[name]

    def _state(self) -> Snapshot:
        if self.state is None:
            raise CapabilityError.lacking(self, "snapshot")
        return self.state

    def render(
        self,
        mask: Mask | None = None,
        camera: str | None = None,
        size: tuple[int, int] = (480, 640),
        modality: str = "rgb",
        markers: Sequence[Marker] = (),
        fast: bool = False,
    ) -> np.ndarray[Any, Any]:
        """Draw environments.

        Args:
            mask: The k environments.
            camera: Name; None: the scene's first.
            size: (height, width) [pixels]
            modality: ``"rgb"``, ``"depth"`` or ``"segmentation"``.
            markers: Drawn, nothing else.
            fast: Whether to omit what only makes images pleasant, such as shadows and smooth edges; cameras among the
                observation terms do.

        Returns:
            (k, h, w, c): rgb uint8 with c = 3; depth float32 [m] with c = 1; segmentation int32 with c = 1, the
            same number for the same body, −1 for nothing.

        Raises:
            RenderingUnavailableError: Nothing can be drawn on this machine.
            UnknownNameError: No such camera or modality.
        """
        raise CapabilityError.lacking(self, "cameras")

    def open_viewer(self) -> None:
        """Open a window that shows the first environment and follows it at each ``step``.

        Raises:
            RenderingUnavailableError: There is no display.
        """
        raise CapabilityError.lacking(self, "cameras")

    def overlaps(self, robot: str = "robot") -> Sequence[Overlap] | None:
        """Return which links of a robot are in each other now, in the first environment, the deepest first.

        Pairs that the engine never lets touch, such as neighbours, are no overlaps.

        Args:
            robot: Its name in the simulation.

        Returns:
            None: not offered.
        """
        return None

    def bare_engine(self) -> BareEngine | None:
        """Return the engine without FRobs, for benchmarks; None: not offered."""
        return None

    def close(self) -> None:
        """Release everything; twice is harmless. Here there is nothing to release."""
