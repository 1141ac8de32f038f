"""A simulation: ``num_envs`` copies of robots and a scene, advanced by an engine.

Arrays are batched, (num_envs, …), float64. An array that is read is current, read-only, and valid until the
next ``reset``, ``step``, ``write_…`` or ``restore``; copy what is to be kept. Masks are (num_envs,) bool, and
None means all environments. A value that is written is (n, …) for the n environments of the mask, in
their order, or broadcasts to it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Protocol, TypeAlias

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import CapabilityError, UnknownNameError
from frobs_core.interfaces.command import CommandMode
from frobs_core.interfaces.robot import Robot
from frobs_core.interfaces.scene import Marker, Placement, Scene
from frobs_core.interfaces.sensor import Lidar
from frobs_core.interfaces.translation import Overlap, Translation
from frobs_core.models.defaults import default_gains, default_tcp, home_positions
from frobs_core.models.model import Pose, RobotModel
from frobs_core.rotations import quat_multiply, quat_rotate

Snapshot: TypeAlias = dict[str, np.ndarray[Any, Any]]
"""A complete state: arrays by name, each (num_envs, …)."""


class RobotHandle(ABC):
    """One robot of a simulation, in every environment.

    The drive law, at the physics rate, is effort = clip(Kp·(q* − q) − Kd·q̇ + ff, ± effort limit), with the
    damping implicit in the velocity. ``POSITION`` commands q* with ff = 0; ``VELOCITY`` commands v* as
    ff = Kd·v* with Kp = 0; ``EFFORT`` commands ff with Kp = Kd = 0.

    Attributes:
        name: In the simulation: ``"robot"`` for the environment's own.
        robot: Its description.
        model: Its model file, read.
        num_envs: Environments of the simulation.
        dof: Actuated joints.
        joint_names: Their names, in the file's order: the order of every joint array.
        tcp: Name of the tool centre point's link.
        home: (num_envs, dof) [rad or m]
        position_lower: (num_envs, dof) [rad or m]; −inf where there is no limit.
        position_upper: (num_envs, dof) [rad or m]
        velocity_limit: (num_envs, dof) [rad/s or m/s]
        effort_limit: (num_envs, dof) [N·m or N]
    """

    name: str
    robot: Robot
    model: RobotModel
    num_envs: int
    dof: int
    joint_names: tuple[str, ...]
    tcp: str
    home: Floats
    position_lower: Floats
    position_upper: Floats
    velocity_limit: Floats
    effort_limit: Floats
    _start: Pose

    def describe(self, name: str, placement: Placement, num_envs: int) -> None:
        """Fill in all attributes of the class, which follow from the placement; a constructor's first call.

        Args:
            name: In the simulation.
            placement: Of the robot.
            num_envs: ≥ 1.

        Raises:
            UnknownNameError: The tool centre point or a joint of the home position is not in the model.
        """
        model, robot = placement.model, placement.robot
        self.name, self.robot, self.model, self.num_envs = name, robot, model, num_envs
        self.joint_names, self.dof = model.joint_names, len(model.joint_names)
        self.tcp = robot.tcp or default_tcp(model)
        self.frame_name("tcp")
        self._start = placement.pose
        limits = [joint.limits for joint in model.actuated_joints]
        self.home = self.expand(home_positions(model, robot.home))
        self.position_lower = self.expand([limit.lower for limit in limits])
        self.position_upper = self.expand([limit.upper for limit in limits])
        self.velocity_limit = self.expand([limit.velocity for limit in limits])
        self.effort_limit = self.expand([limit.effort for limit in limits])

    def described_gains(self) -> tuple[Floats, Floats]:
        """Return Kp and Kd of the robot's description, or else the default gains of its model, (num_envs, dof) each."""
        gains = self.robot.gains or default_gains(self.model, home_positions(self.model, self.robot.home))
        pairs = [gains.of(joint) for joint in self.joint_names]
        return self.expand([kp for kp, _ in pairs]), self.expand([kd for _, kd in pairs])

    def expand(self, row: Sequence[float] | Floats) -> Floats:
        """Return a value for each joint as (num_envs, dof)."""
        return np.repeat(np.asarray(row, np.float64)[None], self.num_envs, axis=0)

    @property
    @abstractmethod
    def joint_positions(self) -> Floats:
        """(num_envs, dof) [rad or m]."""

    @property
    @abstractmethod
    def joint_velocities(self) -> Floats:
        """(num_envs, dof) [rad/s or m/s]."""

    @property
    @abstractmethod
    def joint_efforts(self) -> Floats:
        """(num_envs, dof) [N·m or N]: what the drives applied in the last physics step."""

    @abstractmethod
    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        """Put the joints somewhere at once.

        Args:
            positions: (n, dof) [rad or m]
            velocities: (n, dof) [rad/s or m/s]
            mask: The environments.
        """

    @property
    @abstractmethod
    def command_mode(self) -> CommandMode:
        """What commands mean."""

    @abstractmethod
    def set_command_mode(self, mode: CommandMode) -> None:
        """Change what commands mean, and hold: the present positions, zero velocity or zero effort."""

    @abstractmethod
    def command(self, values: Floats) -> None:
        """Set what the drives follow in the next steps.

        Args:
            values: (num_envs, dof), held; or (num_envs, decimation, dof), one row for each physics step of the
                next ``step``, whose ``decimation`` it must have; afterwards the last row is held.
        """

    @abstractmethod
    def drive_gains(self) -> tuple[Floats, Floats]:
        """Return Kp and Kd, (num_envs, dof) each, whatever the command mode."""

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        """pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4) of the root link in the world."""
        return self.frame_pose(self.model.root)

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (num_envs, 3) [m/s] and ang_vel_world (num_envs, 3) [rad/s] of the root link's origin."""
        return self.frame_velocity(self.model.root)

    @abstractmethod
    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        """Put the root link somewhere at once; a fixed base can be moved too.

        Args:
            pos: (n, 3) [m] in the world.
            quat_wxyz: (n, 4), of length 1.
            mask: The environments.
        """

    @abstractmethod
    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        """Give a free root link a velocity at once.

        Args:
            lin_vel_world: (n, 3) [m/s]
            ang_vel_world: (n, 3) [rad/s]
            mask: The environments.

        Raises:
            SimulationError: The base is fixed.
        """

    @abstractmethod
    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        """Return where a link is in the world.

        Args:
            frame: Name of a link, or ``"tcp"``.
            joint_positions: None: where it is now. (k, dof) [rad or m]: where it would be, with the base
                where the scene places it; the state is not touched, and k is any number.

        Returns:
            pos (num_envs or k, 3) [m] and quat_wxyz (num_envs or k, 4).

        Raises:
            UnknownNameError: No link is named so.
        """

    def planned_frame_pose(self, frame: str, joint_positions: Floats) -> tuple[Floats, Floats]:
        """Return :meth:`frame_pose` for given joint positions, (k, dof) [rad or m]."""
        pos, quat = self.model.frame_pose(self.frame_name(frame), joint_positions)
        base = np.broadcast_to(np.array(self._start.quat_wxyz), quat.shape)
        return quat_rotate(base, pos) + np.array(self._start.pos), quat_multiply(base, quat)

    @abstractmethod
    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        """Return lin_vel_world [m/s] and ang_vel_world [rad/s] of a link's origin, (num_envs, 3) each."""

    @abstractmethod
    def frame_jacobian(self, frame: str) -> Floats:
        """Return (num_envs, 6, dof): rows 0–2 lin_vel_world, rows 3–5 ang_vel_world, per joint velocity."""

    @abstractmethod
    def lidar(self, name: str) -> Floats:
        """Return (num_envs, rays) [m] of a lidar of the robot; it does not see the robot itself."""

    def lidar_rays(self, name: str) -> tuple[Lidar, Floats, Floats]:
        """Return a lidar, and where its rays start [m] and point in the world, (num_envs, rays, 3) each.

        Raises:
            UnknownNameError: The robot has no such lidar.
        """
        if name not in self.robot.lidars:
            raise UnknownNameError("lidar", name, self.robot.lidars)
        lidar = self.robot.lidars[name]
        pos, quat = self.frame_pose(lidar.frame)
        w, x, y, z = (quat[:, i, None] for i in range(4))
        ahead, left = np.empty((2, self.num_envs, 1, 3))  # the frame's x and y axes, in which all rays lie
        ahead[..., 0], ahead[..., 1], ahead[..., 2] = (
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y + w * z),
            2.0 * (x * z - w * y),
        )
        left[..., 0], left[..., 1], left[..., 2] = (
            2.0 * (x * y - w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z + w * x),
        )
        directions = lidar.directions[:, :1] * ahead + lidar.directions[:, 1:2] * left
        if any(lidar.offset):
            pos = pos + quat_rotate(quat, np.broadcast_to(np.array(lidar.offset), pos.shape))
        return lidar, np.broadcast_to(pos[:, None], directions.shape), directions

    def frame_name(self, frame: str) -> str:
        """Resolve ``"tcp"`` and check that the link exists.

        Raises:
            UnknownNameError: No link is named so.
        """
        name = self.tcp if frame == "tcp" else frame
        links = [link.name for link in self.model.links]
        if name not in links:
            raise UnknownNameError("link", name, links if frame == "tcp" else [*links, "tcp"])
        return name


class BodyHandle(ABC):
    """One body of the scene, in every environment."""

    name: str

    @property
    @abstractmethod
    def pose(self) -> tuple[Floats, Floats]:
        """pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4) in the world."""

    @property
    @abstractmethod
    def twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (num_envs, 3) [m/s] and ang_vel_world (num_envs, 3) [rad/s]."""

    @abstractmethod
    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        """Put the body somewhere at once; its velocity becomes 0.

        Args:
            pos: (n, 3) [m]
            quat_wxyz: (n, 4); None: as it is.
            mask: The environments.

        Raises:
            SimulationError: The body is static.
        """


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
        render_modalities: What ``render`` can draw.
    """

    render_modalities: ClassVar[Sequence[str]] = ("rgb", "depth", "segmentation")

    num_envs: int
    physics_timestep: float
    robots: Mapping[str, RobotHandle]
    bodies: Mapping[str, BodyHandle]

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
    @abstractmethod
    def native(self) -> Any:
        """The engine's own objects; a task that uses them is tied to this simulator."""

    @property
    @abstractmethod
    def time(self) -> Floats:
        """(num_envs,) [s] since the reset."""

    @property
    @abstractmethod
    def diverged(self) -> Mask | None:
        """Which environments the engine gave up on since their reset, or None while there are none."""

    @abstractmethod
    def reset(self, mask: Mask | None = None) -> None:
        """Go back to the scene as it was built: robots at home and at rest, drives holding, time 0.

        Physical parameters that were written stay.
        """

    @abstractmethod
    def step(self, decimation: int) -> None:
        """Advance every environment by ``decimation`` physics steps. What is read afterwards is current.

        An environment that diverges stops where it is and shows in :attr:`diverged`; the others go on.

        Raises:
            SimulationError: The engine failed as a whole.
        """

    def contact(self, name: str) -> Mask:
        """(num_envs,) bool: whether a contact that the scene declares was there in any physics step of the last ``step``.

        After a reset there is none, until the next ``step``.

        Raises:
            UnknownNameError: The scene declares no such contact.
        """
        raise self._lacks("contacts")

    def contact_force(self, name: str) -> Floats:
        """(num_envs,) [N]: largest normal force of a declared contact in the last ``step``.

        Raises:
            UnknownNameError: The scene declares no such contact.
            ConfigurationError: The contact ignores something, so that its force is not told.
        """
        raise self._lacks("contacts")

    def rays(self, origins: Floats, directions: Floats, max_range: float) -> Floats:
        """Cast rays.

        Args:
            origins: (num_envs, k, 3) [m]
            directions: (num_envs, k, 3), of length 1.
            max_range: [m]

        Returns:
            (num_envs, k) [m]; ``max_range`` where nothing is hit.
        """
        raise self._lacks("rays")

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
        raise self._lacks("wrench")

    def parameter(self, name: str, target: str = "") -> Floats:
        """Return a physical parameter of each environment.

        Args:
            name: ``mass`` [kg] (num_envs,), with which the inertia goes; ``friction`` (num_envs,), ``stiffness`` and
                ``damping`` (drive gains) and ``joint_damping`` (num_envs, dof), ``gravity`` [m/s²] (num_envs, 3).
            target: For mass and friction a scene body or ``"robot/link"`` (friction also ``"floor"``); for the
                joint parameters a robot's name; for gravity ``""``.

        Raises:
            UnknownNameError: No such parameter or target.
        """
        raise UnknownNameError("parameter", name, ())

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> None:
        """Change a physical parameter; the arguments are those of :meth:`parameter`."""
        raise UnknownNameError("parameter", name, ())

    @abstractmethod
    def snapshot(self) -> Snapshot:
        """Return the complete state: restored, it continues exactly, where the capability says so."""

    @abstractmethod
    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot of this simulation or of one that was built alike."""

    def render(
        self,
        mask: Mask | None = None,
        camera: str | None = None,
        size: tuple[int, int] = (480, 640),
        modality: str = "rgb",
        markers: Sequence[Marker] = (),
    ) -> np.ndarray[Any, Any]:
        """Draw environments.

        Args:
            mask: The k environments.
            camera: Name; None: the scene's first.
            size: (height, width) [pixels]
            modality: ``"rgb"``, ``"depth"`` or ``"segmentation"``.
            markers: Drawn, nothing else.

        Returns:
            (k, h, w, c): rgb uint8 with c = 3; depth float32 [m] with c = 1; segmentation int32 with c = 1, the
            same number for the same body, −1 for nothing.

        Raises:
            RenderingUnavailableError: Nothing can be drawn on this machine.
            UnknownNameError: No such camera or modality.
        """
        raise self._lacks("cameras")

    def open_viewer(self) -> None:
        """Open a window that shows the first environment and follows it at each ``step``.

        Raises:
            RenderingUnavailableError: There is no display.
        """
        raise self._lacks("cameras")

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

    @abstractmethod
    def close(self) -> None:
        """Release everything; twice is harmless."""

    def _lacks(self, capability: str) -> CapabilityError:
        return CapabilityError(type(self).__name__, [("the caller", capability, "approximate", "unsupported")])
