"""A simulation: ``num_envs`` copies of robots and a scene, advanced by an engine.

Arrays are batched, (num_envs, …), float64. Arrays that you read contain the current state and are read-only. Such
arrays are valid until the next ``reset``, ``step``, ``write_…`` or ``restore``, so copy any data that you want to keep.
A mask is a (num_envs,) bool array, or None to select all environments. Values that you write have the shape (n, …) for
the n environments selected by the mask, in their order, or a shape that can be broadcast to it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Protocol

import numpy as np

from frobs_core.contracts.applied_wrenches import Wrench
from frobs_core.contracts.body_handle import BodyHandle
from frobs_core.contracts.contacts import ContactState
from frobs_core.contracts.pacing import Pacer
from frobs_core.contracts.robot_handle import RobotHandle
from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.description import Overlap, Translation
from frobs_core.description.scene import Marker, Placement, Scene
from frobs_core.models.model import RobotModel
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import CapabilityError, UnknownNameError, check_name


class BareEngine(Protocol):
    """A minimal loop that uses an engine directly, without FRobs, for benchmark comparisons."""

    def load(self, snapshot: Snapshot) -> None:
        """Load the state and the control inputs from a simulation's snapshot."""

    def step(self, decimation: int) -> None:
        """Advance by ``decimation`` physics steps."""

    def rays(self, origins: Floats, directions: Floats, max_range: float) -> None:
        """Cast rays with the arguments of :meth:`Simulation.rays` and discard the result."""


class Simulation(Stateful, ABC):
    """Base class of simulations, each of which contains ``num_envs`` copies of robots and a scene.

    If a simulator does not support a capability, the methods of this capability raise
    :class:`~frobs_core.util.errors.CapabilityError`.

    Additional keyword-only parameters of the constructor are options of the simulator. Users pass them to the
    environment as ``simulator_kwargs``, and ``frobs show`` lists them with their descriptions from the class's
    docstring.

    Args:
        robots: All robots by name, including the scene's additional robots and props. The environment's own robot is
            ``"robot"``.
        scene: The rest of the scene.
        num_envs: ≥ 1.
        physics_timestep: [s]
        num_threads: Number of engine threads, or 0 for one per processor.

    Attributes:
        num_envs: Number of environments.
        physics_timestep: [s]
        robots: Handles of the robots, by name.
        bodies: Handles of the scene's bodies, by name.
        contacts: State of the contacts that the scene declares, or None if the simulator does not support contacts.
        pacer: Clock of a paced simulator (capability ``real_time``), or None if simulated time advances only in
            ``step``.
        render_modalities: Modalities that ``render`` supports.
        wrenches: Wrenches that act during the next ``step``. Simulators with the capability ``wrench`` provide this
            list, for example with :class:`~frobs_core.contracts.AppliedWrenches`.
        state: All arrays that ``snapshot`` and ``restore`` copy, by name, or None if the simulator overrides these
            methods or does not support ``snapshot``.
        sensor_wrenches: Readings of all ``Placement.force_torque_sensors`` by ``"robot/sensor"``, (num_envs, 6)
            [N, N·m] each, or None if the simulator does not support force-torque sensors.
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
            At least one row for each element in ``frobs_models.elements(model)``. Elements without a row are
            reported as unknown.
        """
        return ()

    @property
    def native(self) -> Any:
        """The engine's own objects, or None. A task that uses these objects works only with this simulator."""
        return None

    @property
    @abstractmethod
    def time(self) -> Floats:
        """Simulated time since the reset, (num_envs,) [s]."""

    @property
    def measurement_age(self) -> Floats:
        """Age of the measured joint states, (num_envs,) [s]. It is 0 if the simulator reads them in ``step``."""
        return np.zeros(self.num_envs)

    @property
    def diverged(self) -> Mask | None:
        """Mask of the environments in which the engine has failed since their last reset, or None if it never failed."""
        return None

    @abstractmethod
    def reset(self, mask: Mask | None = None) -> None:
        """Reset to the scene's initial state at time 0, with robots at rest at home and held by their drives.

        Only the environments selected by ``mask`` are reset. Physical parameters keep their written values. A paced
        simulator moves the robots to their home positions and returns after they have stopped there. Other bodies are
        not moved.

        Raises:
            SimulationError: The robots of a paced simulator did not reach their home positions in time.
        """

    def step_with(self, decimation: int, update: Callable[[], None]) -> None:
        """Advance like :meth:`step`, and call a function before each physics step except the first.

        The function may read the state and send commands to robots. Applied wrenches act in all physics steps.
        Afterwards, contact states and force-torque readings cover the whole control step.

        Args:
            decimation: Number of physics steps.
            update: Function to call.
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

        An environment that diverges stops in its current state and is marked in :attr:`diverged`, while the other
        environments continue. A paced simulator uses its :attr:`pacer` to wait until the world has advanced.

        Raises:
            SimulationError: The engine failed, so no environment can continue.
        """

    def hold(self) -> None:
        """Command all robots to hold their current positions, with zero velocity or zero effort.

        A paced simulator sends the commands immediately. Otherwise, they apply from the next ``step``.
        """
        for robot in self.robots.values():
            robot.command(robot.holding_command(robot.joint_positions))

    def contact(self, name: str) -> Mask:
        """Return whether a declared contact was closed in any physics step of the last ``step``, (num_envs,) bool.

        All contacts are open between a reset and the next ``step``.

        Raises:
            UnknownNameError: The scene does not declare a contact with this name.
        """
        contacts = self._contacts()
        return read_only(contacts.closed[:, contacts.scene.contact_number(name)])

    def contact_force(self, name: str) -> Floats:
        """Return the largest normal force of the declared contact ``name`` in the last ``step``, (num_envs,) [N].

        For the errors, see :meth:`contact_resultant`.
        """
        contacts = self._contacts()
        return read_only(contacts.normal_force[:, contacts.scene.contact_number(name, force=True)])

    def contact_resultant(self, name: str) -> Floats:
        """Return the total force on a contact's first side, including friction, in the world frame, (num_envs, 3) [N].

        The force is averaged over the physics steps of the last ``step``. Forces between two parts of the first side
        cancel.

        Raises:
            UnknownNameError: The scene does not declare a contact with this name.
            ConfigurationError: The contact ignores some bodies, so its force is not available.
        """
        contacts = self._contacts()
        return read_only(contacts.resultant[:, contacts.scene.contact_number(name, force=True)])

    def _contacts(self) -> ContactState:
        if self.contacts is None:
            raise CapabilityError.lacking(self, "contacts")
        return self.contacts

    def sensor_wrench(self, robot: str, sensor: str) -> Floats:
        """Return the reading of a force-torque sensor, (num_envs, 6): force [N] and torque [N·m] in the sensor's frame.

        The reading is the wrench that the joint's parent link exerts on its child link, averaged over the physics steps
        of the last ``step``. After a reset, the reading is 0. See :class:`~frobs_core.description.ForceTorque`.

        Args:
            robot: Name of the robot in the simulation.
            sensor: Name of the sensor.

        Raises:
            CapabilityError: The simulator does not support ``force_torque``.
            UnknownNameError: The robot has no force-torque sensor with this name.
        """
        if self.sensor_wrenches is None:
            raise CapabilityError.lacking(self, "force_torque")
        name = f"{robot}/{sensor}"
        check_name("force-torque sensor", name, self.sensor_wrenches)
        return read_only(self.sensor_wrenches[name])

    def rays(self, origins: Floats, directions: Floats, max_range: float, exclude: str = "") -> Floats:
        """Cast rays and return the distances to the objects that they hit.

        Args:
            origins: Start points in the world frame, (num_envs, k, 3) [m].
            directions: Unit vectors in the world frame, (num_envs, k, 3).
            max_range: Maximum range of the rays [m].
            exclude: Name of the robot that the rays pass through, such as the robot that carries the sensor, or ``""``
                to detect all robots.

        Returns:
            The distances, (num_envs, k) [m], or ``max_range`` for rays that hit nothing.

        Raises:
            CapabilityError: The simulator does not support ``rays``.
            UnknownNameError: The simulation has no robot ``exclude``.
        """
        raise CapabilityError.lacking(self, "rays")

    def write_body_poses(
        self, names: Sequence[str], pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None
    ) -> None:
        """Teleport several bodies. This is faster than calling :meth:`BodyHandle.write_pose` for each body.

        Args:
            names: Names of k scene bodies.
            pos: Positions of the bodies' origins in the world frame, (n, k, 3) [m].
            quat_wxyz: Orientations, (n, k, 4), or None to keep the current orientations.
            mask: The environments to change.

        Raises:
            SimulationError: A body is static.
        """
        for i, name in enumerate(names):
            self.bodies[name].write_pose(pos[:, i], None if quat_wxyz is None else quat_wxyz[:, i], mask)

    def apply_wrench(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> None:
        """Apply a force and a torque at a body's center of mass during the next ``step``.

        On a link without mass, they act at the link's origin. If the method is called several times before a step, the
        wrenches add up. A snapshot includes the wrenches of the next step, and a reset removes them.

        Args:
            body: A scene body, or ``"robot/link"``.
            force_world: (n, 3) [N]
            torque_world: (n, 3) [N·m]
            mask: The environments to change.
        """
        raise CapabilityError.lacking(self, "wrench")

    def parameter(self, name: str, target: str = "") -> Floats:
        """Return a physical parameter for each environment, (num_envs, …).

        Args:
            name: Name of the parameter. ``mass`` [kg], ``friction`` and ``size`` have the shape (num_envs,). Changing
                ``mass`` also scales the inertia. ``size`` is a factor for all lengths of a body and does not affect its
                mass. The drive gains ``stiffness`` and ``damping``, and ``joint_damping``, have the shape (num_envs,
                dof). ``gravity`` [m/s²] has the shape (num_envs, 3).

                The other parameters change only images. ``color`` is (num_envs, 3) in [0, 1]; its target ``"sky"`` is
                the background, which is plain as soon as its color is written. ``light`` is a factor of
                the brightness of ``"sun"`` or ``"ambient"``. ``camera_position`` [m] and ``camera_rotation``, a rotation
                vector [rad] in the axes of the camera's image (right, up, back), are (num_envs, 3), and ``camera_fov``
                [deg], from 1 to 170, is the vertical field of view. ``texture`` is the number of a pattern of the floor,
                from 0, the ordinary one, to 64. ``distractors`` is the number of objects without collisions that lie
                around the scene, up to 8. The fraction after its decimal point chooses their shapes, colors and places.
            target: A scene body or ``"robot/link"`` for mass; a scene body, ``"robot/link"`` or ``"floor"`` for
                friction; a scene body for size; a robot's name for joint parameters; ``""`` for gravity.

        Raises:
            UnknownNameError: The parameter or target does not exist.
        """
        raise UnknownNameError("parameter", name, ())

    def parameter_targets(self, name: str) -> Sequence[str]:
        """Return the targets of the parameter ``name``: ``size``, one that changes images, or one that a plugin adds.

        For each target of the latter, :meth:`parameter` returns an array of the shape (num_envs,).
        """
        return ()

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> None:
        """Change a physical parameter. For the names, targets and errors, see :meth:`parameter`.

        Args:
            name: Name of the parameter.
            target: Body, link, robot or ``""`` to which the parameter belongs.
            values: New values, (n, …), in the unit of the parameter.
            mask: The environments to change.
        """
        raise UnknownNameError("parameter", name, ())

    def snapshot(self) -> Snapshot:
        """Return the complete state.

        If the simulator supports exact snapshots, a restored simulation continues exactly like the original.

        Raises:
            CapabilityError: The simulator does not support ``snapshot``.
        """
        return super().snapshot()

    def stored_arrays(self) -> Snapshot:
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
            mask: Mask of the k environments to render.
            camera: Name of the camera, or None for the scene's first camera.
            size: (height, width) [pixels]
            modality: ``"rgb"``, ``"depth"`` or ``"segmentation"``.
            markers: Spheres to draw.
            fast: Whether to omit purely visual effects, such as shadows and smooth edges. Camera observations use this
                option.

        Returns:
            Images of the shape (k, h, w, c). ``"rgb"`` is uint8 with c = 3, and ``"depth"`` is float32 [m] with c = 1.
            ``"segmentation"`` is int32 with c = 1 and contains one segmentation ID per body, and −1 for the background.

        Raises:
            RenderingUnavailableError: This machine cannot render.
            UnknownNameError: The camera or modality does not exist.
        """
        raise CapabilityError.lacking(self, "cameras")

    def open_viewer(self) -> None:
        """Open a window that shows the first environment and is updated at each ``step``.

        Raises:
            RenderingUnavailableError: There is no display.
        """
        raise CapabilityError.lacking(self, "cameras")

    def overlaps(self, robot: str = "robot") -> Sequence[Overlap] | None:
        """Return the pairs of overlapping links of a robot in the first environment, deepest overlap first.

        Pairs for which the engine disables collisions, such as neighboring links, are not reported.

        Args:
            robot: Name of the robot in the simulation.

        Returns:
            The overlaps, or None if the simulator cannot detect overlaps.
        """
        return None

    def bare_engine(self) -> BareEngine | None:
        """Return a bare engine for benchmarks, or None if the simulator does not provide one."""
        return None

    def close(self) -> None:
        """Release all resources. Repeated calls have no effect. The default implementation does nothing."""
