"""A simulation: ``num_envs`` copies of robots and a scene, advanced by an engine.

Arrays are batched, (num_envs, …), float64. Arrays that you read are current and read-only. They are valid until the
next ``reset``, ``step``, ``write_…`` or ``restore``, so copy what you want to keep. Masks are (num_envs,) bool; None
means all environments. Values that you write are (n, …) for the n environments of the mask, in their order, or
broadcast to this shape.
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
    """A minimal loop over an engine as its users would write it, for benchmark comparisons."""

    def load(self, snapshot: Snapshot) -> None:
        """Load the state and the controls from a simulation's snapshot."""

    def step(self, decimation: int) -> None:
        """Advance by ``decimation`` physics steps."""

    def rays(self, origins: Floats, directions: Floats, max_range: float) -> None:
        """Cast rays with the arguments of :meth:`Simulation.rays`, and discard the result."""


class Simulation(ABC):
    """``num_envs`` copies of robots and a scene.

    Methods of a capability that a simulator does not support raise :class:`~frobs_core.errors.CapabilityError`.

    Additional keyword-only parameters of the constructor are options of the simulator. Users pass them to the
    environment as ``simulator_kwargs``, and ``frobs show`` lists them with their descriptions from the class's
    docstring.

    Args:
        robots: Robots by name; the environment's own is ``"robot"``. They include those of the scene.
        scene: The rest of the scene.
        num_envs: ≥ 1.
        physics_timestep: [s]
        num_threads: Threads of the engine, or 0 for one per processor.

    Attributes:
        num_envs: Number of environments.
        physics_timestep: [s]
        robots: Handles of the robots, by name.
        bodies: Handles of the scene's bodies, by name.
        contacts: State of the contacts that the scene declares; None if the simulator does not support contacts.
        pacer: Clock of a paced simulator, which has the ability ``real_time``; None: time only passes in ``step``.
        render_modalities: Modalities that ``render`` supports.
        wrenches: Wrenches that act in the next ``step``; maintained by simulators with the ability ``wrench``.
        state: All arrays that change, by name, for ``snapshot`` and ``restore`` to copy. None: the simulator overrides
            both, or does not support ``snapshot``.
        sensor_wrenches: Readings of the force-torque sensors, (num_envs, 6) each, by ``"robot/sensor"``, one for each
            of :attr:`Placement.force_torque_sensors`; None: not supported.
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
        """Describe how a robot's model file is translated, for ``frobs doctor robot``. No simulation is built.

        Args:
            model: Model of the robot.

        Returns:
            At least one row for each of ``frobs_core.models.elements(model)``. Omitted elements are shown as unknown.
        """
        return ()

    @property
    def native(self) -> Any:
        """The engine's own objects, if any. A task that uses them only works with this simulator."""
        return None

    @property
    @abstractmethod
    def time(self) -> Floats:
        """(num_envs,) [s] since the reset."""

    @property
    def diverged(self) -> Mask | None:
        """Environments in which the engine has failed since their reset, or None if there are none."""
        return None

    @abstractmethod
    def reset(self, mask: Mask | None = None) -> None:
        """Return to the initial state of the scene: robots at home and at rest, drives holding, time 0.

        Physical parameters keep their written values. A paced simulator drives the robots home and returns when they
        have arrived and stopped; bodies stay where they are.

        Raises:
            SimulationError: The robots of a paced simulator did not arrive at home in time.
        """

    def step_with(self, decimation: int, update: Callable[[], None]) -> None:
        """Advance like :meth:`step`, but call a function before each physics step except the first.

        The function may read the state and command robots. Applied wrenches act in all physics steps. Contacts and
        force-torque sensors afterwards cover the whole control step.

        Args:
            decimation: Number of physics steps.
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
        """Advance every environment by ``decimation`` physics steps.

        An environment that diverges stops where it is and is marked in :attr:`diverged`; the others continue. A paced
        simulator uses its :attr:`pacer` to wait until the world has advanced.

        Raises:
            SimulationError: The engine failed entirely.
        """

    def contact(self, name: str) -> Mask:
        """(num_envs,) bool: whether a declared contact was closed in any physics step of the last ``step``.

        All contacts are open between a reset and the next ``step``.

        Raises:
            UnknownNameError: The scene declares no such contact.
        """
        contacts = self._contacts()
        return read_only(contacts.closed[:, contacts.scene.contact_number(name)])

    def contact_force(self, name: str) -> Floats:
        """(num_envs,) [N]: largest normal force of a declared contact in the last ``step``.

        Raises:
            UnknownNameError: The scene declares no such contact.
            ConfigurationError: The contact ignores something, so its force is not available.
        """
        contacts = self._contacts()
        return read_only(contacts.normal_force[:, contacts.scene.contact_number(name, force=True)])

    def contact_resultant(self, name: str) -> Floats:
        """(num_envs, 3) [N]: total force on the first side of a declared contact, in the world, including friction.

        It is averaged over the physics steps of the last ``step``. Forces between two parts of the first side cancel.

        Raises:
            UnknownNameError: The scene declares no such contact.
            ConfigurationError: The contact ignores something, so its force is not available.
        """
        contacts = self._contacts()
        return read_only(contacts.resultant[:, contacts.scene.contact_number(name, force=True)])

    def _contacts(self) -> ContactState:
        if self.contacts is None:
            raise CapabilityError.lacking(self, "contacts")
        return self.contacts

    def sensor_wrench(self, robot: str, sensor: str) -> Floats:
        """Return a reading of a force-torque sensor, (num_envs, 6): force [N] and torque [N·m] in the sensor's frame.

        It is the wrench that the parent exerts on the child, averaged over the physics steps of the last ``step``; 0
        after a reset. See :class:`~frobs_core.interfaces.ForceTorque`.

        Args:
            robot: Name of the robot in the simulation.
            sensor: Name of the sensor.

        Raises:
            CapabilityError: The simulator does not support ``force_torque``.
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
        """Teleport several bodies. This is faster than calling :meth:`BodyHandle.write_pose` for each body.

        Args:
            names: Names of k scene bodies.
            pos: (n, k, 3) [m]
            quat_wxyz: (n, k, 4), or None to keep the orientations.
            mask: The environments to change.

        Raises:
            SimulationError: A body is static.
        """
        for i, name in enumerate(names):
            self.bodies[name].write_pose(pos[:, i], None if quat_wxyz is None else quat_wxyz[:, i], mask)

    def apply_wrench(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> None:
        """Apply a force and a torque at a body's center of mass during the next ``step``.

        Args:
            body: A scene body, or ``"robot/link"``.
            force_world: (n, 3) [N]
            torque_world: (n, 3) [N·m]
            mask: The environments to change.
        """
        raise CapabilityError.lacking(self, "wrench")

    def parameter(self, name: str, target: str = "") -> Floats:
        """Return a physical parameter for each environment.

        Args:
            name: ``mass`` [kg] (num_envs,), which also scales the inertia; ``friction`` (num_envs,); ``size``
                (num_envs,), a factor for all lengths of a body, whose mass stays the same; ``stiffness`` and
                ``damping`` (drive gains) and ``joint_damping`` (num_envs, dof); ``gravity`` [m/s²] (num_envs, 3).
            target: A scene body or ``"robot/link"`` for mass and friction (for friction also ``"floor"``), a scene body
                for size, a robot's name for the joint parameters, ``""`` for gravity.

        Raises:
            UnknownNameError: The parameter or target does not exist.
        """
        raise UnknownNameError("parameter", name, ())

    def parameter_targets(self, name: str) -> Sequence[str]:
        """Return the targets of ``size``, or of a parameter that a plugin adds.

        For each target, :meth:`parameter` returns (num_envs,).
        """
        return ()

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> None:
        """Change a physical parameter. The arguments are those of :meth:`parameter`."""
        raise UnknownNameError("parameter", name, ())

    def snapshot(self) -> Snapshot:
        """Return the complete state. If the capability is exact, a restored simulation continues exactly.

        Raises:
            CapabilityError: The simulator does not support ``snapshot``.
        """
        return {name: array.copy() for name, array in self._state().items()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot of this simulation or of one with the same configuration."""
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
        """Render environments.

        Args:
            mask: The k environments to render.
            camera: Name of the camera, or None for the scene's first camera.
            size: (height, width) [pixels]
            modality: ``"rgb"``, ``"depth"`` or ``"segmentation"``.
            markers: Spheres to draw.
            fast: Whether to omit purely visual effects, such as shadows and smooth edges. Cameras among the observation
                terms use this.

        Returns:
            (k, h, w, c): rgb uint8 with c = 3; depth float32 [m] with c = 1; segmentation int32 with c = 1, one number
            per body, −1 for the background.

        Raises:
            RenderingUnavailableError: This machine cannot render.
            UnknownNameError: The camera or modality does not exist.
        """
        raise CapabilityError.lacking(self, "cameras")

    def open_viewer(self) -> None:
        """Open a window that shows the first environment and updates in each ``step``.

        Raises:
            RenderingUnavailableError: There is no display.
        """
        raise CapabilityError.lacking(self, "cameras")

    def overlaps(self, robot: str = "robot") -> Sequence[Overlap] | None:
        """Return the pairs of overlapping links of a robot in the first environment, deepest first.

        Pairs that the engine never lets collide, such as neighbors, are not reported.

        Args:
            robot: Name of the robot in the simulation.

        Returns:
            The overlaps, or None if the simulator does not support this.
        """
        return None

    def bare_engine(self) -> BareEngine | None:
        """Return the bare engine, for benchmarks; None if the simulator does not support this."""
        return None

    def close(self) -> None:
        """Release all resources. Repeated calls have no effect. The default implementation does nothing."""
