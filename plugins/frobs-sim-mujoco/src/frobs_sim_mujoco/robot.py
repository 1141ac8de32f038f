"""The handle of a robot in a MuJoCo simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

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
        self._body_ids: dict[str, int] = {}
        self._poses: dict[str, tuple[Floats, Floats]] = {}
        self._motions: dict[str, tuple[Floats, Floats, Floats, Floats | None]] = {}
        bodies = {mj.body(i).name for i in range(mj.nbody)}
        self._between = {joint.child: joint for joint in model.joints if f"{name}/{joint.child}" not in bodies}
        self._positions = _view(self._qpos, self._q_columns)
        self._velocities = _view(self._qvel, self.dofs)

    @property
    def joint_positions(self) -> Floats:
        """Joint positions, (num_envs, dof) [rad or m]."""
        return np.take(self._qpos, self._q_columns, axis=1) if self._positions is None else self._positions

    @property
    def joint_velocities(self) -> Floats:
        """Joint velocities, (num_envs, dof) [rad/s or m/s]."""
        return np.take(self._qvel, self.dofs, axis=1) if self._velocities is None else self._velocities

    @property
    def joint_efforts(self) -> Floats:
        """Efforts that the drives applied in the last physics step, (num_envs, dof) [N·m or N]."""
        return self._efforts

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        """Set the joint state without simulating the motion."""
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
        """Change the command mode, and then command the current positions, zero velocity or zero effort."""
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
        """Set the drives' targets."""
        if values.ndim == 2:
            np.multiply(self._factor, values, out=self._ctrl)
        else:
            self._simulation.set_rows(self.actuators, self._factor[:, None] * values)

    def _hold(self) -> None:
        self.command(self.holding_command(self.joint_positions))

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        """Pose of the root link in the world frame: pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4)."""
        return self.frame_pose(self.model.root)

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        """Twist at the root link's origin: lin_vel_world (num_envs, 3) [m/s], ang_vel_world (num_envs, 3) [rad/s]."""
        return self.frame_velocity(self.model.root)

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        """Teleport the root link."""
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
        """Set the velocity of a free root link."""
        if self._free is None:
            raise SimulationError(f"robot '{self.name}' has a fixed base, so its velocity cannot be set.")
        put_free_twist(self._states, self._free, numbers_of(mask), lin_vel_world, ang_vel_world)
        self._simulation.mark_stale(mask)

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        """Return the pose of a link in the world frame, at the current or given joint positions."""
        if joint_positions is not None:
            return self.planned_frame_pose(frame, joint_positions)
        pose = self._poses.get(frame)
        if pose is None:
            if (link := self.frame_name(frame)) in self._between:
                return self._pose_between(self._between[link])
            body, derived = self._body(frame), self._simulation.derived
            pose = derived("xpos")[:, body], derived("xquat")[:, body]
            self._poses[frame] = pose  # views of arrays that the batch updates in place
        self._simulation.refresh()
        return pose

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        """Return lin_vel_world [m/s] and ang_vel_world [rad/s] of a link's origin, (num_envs, 3) each."""
        twist = self._simulation.derived("cvel")[
            :, self._body(frame)
        ]  # angular and linear velocity about the tree's center of mass
        pos, _ = self.frame_pose(frame)
        arm = pos - self._simulation.derived("subtree_com")[:, self._tree]
        return twist[:, 3:] + cross(twist[:, :3], arm), twist[:, :3]

    def frame_jacobian(self, frame: str) -> Floats:
        """Return a link's Jacobian, (num_envs, 6, dof): lin_vel_world in rows 0–2 and ang_vel_world in rows 3–5."""
        cached = self._motions.get(frame)
        if cached is None:
            link = self.frame_name(frame)
            # In MuJoCo, joints that mimic others have their own degrees of freedom.
            if link in self._between or any(joint.mimic for joint in joint_path(self.model, link)):
                return super().frame_jacobian(frame)
            # Views of arrays that the batch updates in place: reference points, and dof motions (num_envs, 6, nv).
            centre = self._simulation.derived("subtree_com")[:, self._tree]
            motions = self._simulation.derived("cdof").transpose(0, 2, 1)
            cached = self._motions[frame] = self.frame_pose(frame)[0], centre, motions, self._moved_by(frame)
        self._simulation.refresh()
        pos, centre, motions, moved = cached
        np.subtract(pos, centre, out=self._arm[:, 0])
        np.matmul(self._arm, _ARM, out=self._shift)
        np.add(self._shift, self._swap, out=self._shift)
        jacobian: Floats = np.matmul(self._shift_matrix, motions[:, :, self.dofs])
        return jacobian if moved is None else jacobian * moved

    def lidar(self, name: str) -> Floats:
        """Return the ranges measured by one of the robot's lidars, (num_envs, rays) [m]."""
        lidar, origins, directions = self.lidar_rays(name)
        distances = self._simulation.cast(origins, directions, lidar.range_max, self.seen, from_one_point=True)
        return np.maximum(distances, lidar.range_min)

    def _pose_between(self, joint: Joint) -> tuple[Floats, Floats]:
        """Return the pose of a link that is not a MuJoCo body, because it lies between two joints of one MJCF body."""
        pos, quat = self.frame_pose(joint.parent)
        element = self._simulation.model.joint(f"{self.name}/{joint.name}")
        rest = self._simulation.model.qpos0[element.qposadr] if joint.name in self.model.passive_joints else 0.0
        return moved(joint, pos, quat, self._qpos[:, element.qposadr] - rest)

    def _body(self, frame: str) -> int:
        body = self._body_ids.get(frame)
        if body is None:
            link = self.frame_name(frame)
            try:
                body = self._body_ids[frame] = int(self._simulation.model.body(f"{self.name}/{link}").id)
            except KeyError as error:
                raise SimulationError(
                    f"link '{link}' is between the joints of one MJCF body, for which MuJoCo does not compute "
                    "velocities."
                ) from error
        return body

    def _moved_by(self, frame: str) -> Floats | None:
        """Return 1 for each joint that moves the link, otherwise 0, (dof,), or None if all joints move the link."""
        mj, body = self._simulation.model, self._body(frame)
        chain = set()
        while body:
            chain.add(body)
            body = int(mj.body_parentid[body])
        moved = np.array([float(mj.dof_bodyid[dof] in chain) for dof in np.arange(mj.nv)[self.dofs]])
        return None if moved.all() else moved


def _view(state: Floats, columns: slice | np.ndarray) -> Floats | None:
    """Return a read-only view of columns, or None if the columns are not consecutive."""
    if not isinstance(columns, slice):
        return None
    return read_only(state[:, columns])
