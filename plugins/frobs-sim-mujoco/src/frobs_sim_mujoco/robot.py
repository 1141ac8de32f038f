"""The handle of a robot in a MuJoCo simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.description import Placement
from frobs_core.models import Joint, joint_path, moved
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import SimulationError
from frobs_core.util.rotations import cross
from frobs_sim_mujoco.body import put_free_twist
from frobs_sim_mujoco.columns import columns_of, numbers_of, put
from frobs_sim_mujoco.geoms import seen_except

if TYPE_CHECKING:
    from frobs_sim_mujoco.simulation import MujocoSimulation


# A twist (angular, linear) about a point p becomes (linear − arm × angular, angular) about p + arm. The (6, 6) matrix
# of this conversion is _SWAP + arm @ _ARM. The constants are flattened to (36,) and (3, 36), so that a single product
# computes the matrices of all environments.
_SWAP = np.eye(6)[[3, 4, 5, 0, 1, 2]].ravel()
_ARM = np.zeros((3, 36))
_ARM.reshape(3, 6, 6)[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
_ARM.reshape(3, 6, 6)[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = -1.0


class _Frame(NamedTuple):
    """Views of a link's state in arrays that the batch updates in place.

    Attributes:
        pose: Position, (num_envs, 3) [m], and orientation, (num_envs, 4), in the world frame.
        linear: Linear velocity of the link's point at the tree's center of mass, (num_envs, 3) [m/s].
        angular: Angular velocity, (num_envs, 3) [rad/s].
        center: Center of mass of the link's tree, (num_envs, 3) [m].
        motions: Angular and linear velocity at the center of mass per joint velocity, (num_envs, 6, nv), or None if
            MuJoCo's degrees of freedom are not the robot's.
        moved: 1 for each joint that moves the link, otherwise 0, (dof,), or None if all joints move the link.
    """

    pose: tuple[Floats, Floats]
    linear: Floats
    angular: Floats
    center: Floats
    motions: Floats | None
    moved: Floats | None


class MujocoRobot(RobotHandle):
    """Handle of a robot in all environments. See :class:`frobs_core.contracts.RobotHandle`."""

    def __init__(self, simulation: MujocoSimulation, name: str, placement: Placement, group: int) -> None:
        self._simulation = simulation
        self._batch = simulation.batch
        self.seen = seen_except(group)  # geom groups that the robot's lidars detect
        self.describe(name, placement, simulation.num_envs)
        model, mj, n = placement.model, simulation.model, simulation.num_envs
        joints = [mj.joint(f"{name}/{joint}").id for joint in self.joint_names]
        self.dofs = columns_of([mj.jnt_dofadr[j] for j in joints])
        self._states = states = simulation.states
        self._qpos, self._qvel = states["qpos"], states["qvel"]
        self._q_columns = columns_of([mj.jnt_qposadr[j] for j in joints])
        actuators = [mj.actuator(f"{name}/{joint}").id for joint in self.joint_names]
        self.actuators = slice(actuators[0], actuators[0] + self.dof) if actuators else slice(0, 0)
        self._ctrl = states["ctrl"][:, self.actuators]  # a view of the batch's states
        self._efforts = read_only(simulation.efforts[:, self.actuators])
        self.gains_written = False
        self._mimics = [
            (mj.joint(f"{name}/{joint.name}").qposadr[0], self.joint_names.index(joint.mimic.joint), joint.mimic)
            for joint in model.joints
            if joint.mimic is not None
        ]
        self._root = mj.body(f"{name}/{model.root}").id
        self._mocap = int(mj.body_mocapid[self._root])
        self._free = None if self._mocap >= 0 else mj.joint(f"{name}/base")
        self._tree = int(mj.body_rootid[self._root])
        self._arm, self._shift = np.zeros((n, 1, 3)), np.zeros((n, 1, 36))
        self._shift_matrix = self._shift.reshape(n, 6, 6)
        self._swap = np.broadcast_to(_SWAP, self._shift.shape).copy()
        self._frames: dict[str, _Frame] = {}
        bodies = {mj.body(i).name for i in range(mj.nbody)}
        self._between = {joint.child: joint for joint in model.joints if f"{name}/{joint.child}" not in bodies}
        self._bodies: np.ndarray | None = None  # of the links, found when link_poses is first called
        self._positions = _view(self._qpos, self._q_columns)
        self._velocities = _view(self._qvel, self.dofs)

    @property
    def joint_positions(self) -> Floats:
        return np.take(self._qpos, self._q_columns, axis=1) if self._positions is None else self._positions

    @property
    def joint_velocities(self) -> Floats:
        return np.take(self._qvel, self.dofs, axis=1) if self._velocities is None else self._velocities

    @property
    def joint_efforts(self) -> Floats:
        return self._efforts

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        rows = numbers_of(mask)
        put(self._qpos, rows, self._q_columns, positions)
        put(self._qvel, rows, self.dofs, velocities)
        for address, source, mimic in self._mimics:
            self._qpos[rows, address] = mimic.multiplier * self.joint_positions[rows, source] + mimic.offset
        self._simulation.mark_stale(mask)

    def go_home(self) -> None:
        """Set the joints to their home positions at rest, and command the drives to hold these positions."""
        self.write_joint_state(self.home)
        self._hold()

    def set_command_mode(self, mode: CommandMode | Sequence[CommandMode]) -> None:
        self._set_modes(mode)
        self.apply_gains()
        self._hold()

    def write_gains(self, which: int, rows: slice | np.ndarray, values: Floats) -> None:
        """Set Kp (``which=0``) or Kd (``which=1``) for the environments in ``rows``, without changing the targets."""
        ratio = self._write_gains(which, rows, values)
        self.apply_gains()
        self._ctrl[rows] *= ratio
        self.gains_written = True

    def hold_home(self, rows: slice | np.ndarray) -> None:
        """Command the home positions, zero velocity or zero effort, using the current gains."""
        self._ctrl[rows] = self._factor[rows] * self.holding_command(self.home[rows])

    def apply_gains(self) -> None:
        """Write each environment's gains for the current command modes to MuJoCo's model."""
        self.refresh_gains()
        bias = self._batch.expand("actuator_biasprm")
        bias[:, self.actuators, 1:3] = -np.stack([self._active_stiffness, self._active_damping], axis=-1)

    def command(self, values: Floats) -> None:
        if values.ndim == 2:
            np.multiply(self._factor, values, out=self._ctrl)
        else:
            self._simulation.set_rows(self.actuators, self._factor[:, None] * values)

    def _hold(self) -> None:
        self.command(self.holding_command(self.joint_positions))

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        return self.frame_pose(self.model.root)

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        return self.frame_velocity(self.model.root)

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        rows = numbers_of(mask)
        if self._free is None:
            self._states["mocap_pos"][rows, self._mocap] = pos
            self._states["mocap_quat"][rows, self._mocap] = quat_wxyz
        else:
            at = self._free.qposadr[0]
            self._qpos[rows, at : at + 3] = pos
            self._qpos[rows, at + 3 : at + 7] = quat_wxyz
        self._simulation.mark_stale(mask)

    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        if self._free is None:
            raise SimulationError(f"robot '{self.name}' has a fixed base, so its velocity cannot be set.")
        put_free_twist(self._states, self._free, numbers_of(mask), lin_vel_world, ang_vel_world)
        self._simulation.mark_stale(mask)

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        if joint_positions is not None:
            return self.planned_frame_pose(frame, joint_positions)
        views = self._frames.get(frame)
        if views is None:
            link = self.frame_name(frame)
            if link in self._between:
                return self._pose_between(self._between[link])
            views = self._bind_frame(frame)
        if self._simulation.stale is not None:
            self._simulation.refresh()
        return views.pose

    def link_poses(self) -> tuple[Floats, Floats]:
        if self._between:
            poses = [self.frame_pose(link.name) for link in self.model.links]
            return np.stack([pos for pos, _ in poses], axis=1), np.stack([quat for _, quat in poses], axis=1)
        if self._bodies is None:
            mj = self._simulation.model
            self._bodies = np.array([mj.body(f"{self.name}/{link.name}").id for link in self.model.links])
        pos, quat = (self._simulation.derived(field)[:, self._bodies] for field in ("xpos", "xquat"))
        return pos, quat

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        views = self._frames.get(frame) or self._bind_frame(frame)
        if self._simulation.stale is not None:
            self._simulation.refresh()
        return views.linear + cross(views.angular, views.pose[0] - views.center), views.angular

    def frame_jacobian(self, frame: str) -> Floats:
        views = self._frames.get(frame)
        if views is None:
            if self.frame_name(frame) in self._between:
                return super().frame_jacobian(frame)
            views = self._bind_frame(frame)
        if views.motions is None:
            return super().frame_jacobian(frame)
        if self._simulation.stale is not None:
            self._simulation.refresh()
        np.subtract(views.pose[0], views.center, out=self._arm[:, 0])
        np.matmul(self._arm, _ARM, out=self._shift)
        np.add(self._shift, self._swap, out=self._shift)
        jacobian: Floats = np.matmul(self._shift_matrix, views.motions[:, :, self.dofs])
        return jacobian if views.moved is None else jacobian * views.moved

    def lidar(self, name: str) -> Floats:
        lidar, origins, directions = self.lidar_rays(name)
        distances = self._simulation.cast(origins, directions, lidar.range_max, self.seen, from_one_point=True)
        return np.maximum(distances, lidar.range_min)

    def _pose_between(self, joint: Joint) -> tuple[Floats, Floats]:
        """Return the pose of a link that is not a MuJoCo body, because it lies between two joints of one MJCF body."""
        pos, quat = self.frame_pose(joint.parent)
        element = self._simulation.model.joint(f"{self.name}/{joint.name}")
        rest = self._simulation.model.qpos0[element.qposadr] if joint.name in self.model.passive_joints else 0.0
        return moved(joint, pos, quat, self._qpos[:, element.qposadr] - rest)

    def _bind_frame(self, frame: str) -> _Frame:
        """Find a link's body, and store views of its state for later calls."""
        link, mj, derived = self.frame_name(frame), self._simulation.model, self._simulation.derived
        if link in self._between:
            raise SimulationError(
                f"link '{link}' is between the joints of one MJCF body, for which MuJoCo does not compute velocities."
            )
        body = int(mj.body(f"{self.name}/{link}").id)
        pos, quat_wxyz, twist = (derived(field)[:, body] for field in ("xpos", "xquat", "cvel"))
        # In MuJoCo, joints that mimic others have their own degrees of freedom.
        has_mimics = any(joint.mimic for joint in joint_path(self.model, link))
        motions = None if has_mimics else derived("cdof").transpose(0, 2, 1)
        chain = set()
        while body:
            chain.add(body)
            body = int(mj.body_parentid[body])
        moved = np.array([float(mj.dof_bodyid[dof] in chain) for dof in np.arange(mj.nv)[self.dofs]])
        views = self._frames[frame] = _Frame(
            pose=(pos, quat_wxyz),
            linear=twist[:, 3:],
            angular=twist[:, :3],
            center=derived("subtree_com")[:, self._tree],
            motions=motions,
            moved=None if moved.all() else moved,
        )
        return views


def _view(state: Floats, columns: slice | np.ndarray) -> Floats | None:
    """Return a read-only view of columns, or None if the columns are not consecutive."""
    if not isinstance(columns, slice):
        return None
    return read_only(state[:, columns])
