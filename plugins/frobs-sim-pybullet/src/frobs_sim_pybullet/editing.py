"""Reads from and writes to one environment between steps."""

from __future__ import annotations

import math
import os
import tempfile
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_sim_pybullet.articulation import FASTEST
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.transforms import compose, from_array
from frobs_sim_pybullet.world import ROBOT_GROUPS, World


class EditableWorld(World):
    """An environment whose state can be written, saved and restored, and whose bodies can be pushed."""

    def write_joints(self, robot: str, positions: Floats, velocities: Floats) -> None:
        """Set a robot's joint positions and velocities, (dof,) each.

        Values that Bullet cannot handle are not written. Instead, the environment diverges at the next step, which ends
        the episode.
        """
        if not (math.hypot(*positions) < math.inf and math.hypot(*velocities) < FASTEST):
            self._broken = True
            return
        self.robots[robot].write_joints(positions.tolist(), velocities.tolist())
        self._written()

    def write_base_pose(self, robot: str, pose: Floats) -> None:
        """Teleport a robot's root link to a pose, (7,): position [m] and quat_wxyz."""
        if not self._can_bear(pose):
            return
        articulation = self.robots[robot]
        motion = p.getBaseVelocity(articulation.body, self.client)
        articulation.put_root(from_array(pose))
        if articulation.floating:
            p.resetBaseVelocity(articulation.body, *motion, self.client)
        self._written()

    def write_base_twist(self, robot: str, twist: Floats) -> None:
        """Set a root link's twist in the world frame, (6,): linear velocity of its origin, and angular velocity."""
        if not self._can_bear(twist):
            return
        articulation = self.robots[robot]
        base = articulation.base()
        origin = compose(base, articulation.bones.root)[0]
        com = p.getBasePositionAndOrientation(articulation.body, self.client)[0]
        lin, ang = twist[:3], twist[3:]
        lin = lin + np.cross(ang, np.subtract(com, origin))
        p.resetBaseVelocity(articulation.body, lin.tolist(), ang.tolist(), self.client)
        self._written()

    def write_bodies(self, names: list[str], pos: Floats, quat_wxyz: Floats | None = None) -> None:
        """Teleport k bodies to positions (k, 3) and orientations (k, 4), and set their velocities to 0."""
        if not self._can_bear(pos.ravel() if quat_wxyz is None else np.concatenate([pos, quat_wxyz], axis=1).ravel()):
            return
        for i, name in enumerate(names):
            if quat_wxyz is None:
                quat = self.body_frame(name)[1]
            else:
                w, x, y, z = quat_wxyz[i].tolist()
                quat = x, y, z, w
            self._put(name, (tuple(pos[i].tolist()), quat))
            p.resetBaseVelocity(self.bodies[name], (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), self.client)
        self._written()

    def write_body_twist(self, body: str, twist: Floats) -> None:
        """Set a free body's twist in the world frame, (6,): linear velocity of its origin, and angular velocity."""
        if self._can_bear(twist):
            lin_x, lin_y, lin_z, *ang = twist.tolist()
            self._set_twist(body, (lin_x, lin_y, lin_z), tuple(ang))
            self._written()

    def _can_bear(self, values: Floats) -> bool:
        bearable = math.hypot(*values) < FASTEST
        if not bearable:
            self._broken = True
        return bearable

    def rays(self, origins: Floats, directions: Floats, max_range: float, exclude: str) -> Floats:
        """Cast k rays, and return the distance at which each ray hits something, (k,) [m]."""
        mask = ~ROBOT_GROUPS[list(self.robots).index(exclude)] if exclude else -1
        return self._rays.cast(origins, directions, max_range, mask)

    def push(self, target: str, force: Floats, torque: Floats) -> None:
        """Apply a force and a torque, (3,) each, to the center of mass of a body or ``robot/link`` in the next step."""
        if target in self.bodies:
            self._body_pushes.append((self.bodies[target], tuple(force.tolist()), tuple(torque.tolist())))
            return
        robot, _, link = target.partition("/")
        self._drives[robot].push(link, tuple(force.tolist()), tuple(torque.tolist()))

    def write_parameter(self, name: str, target: str, value: Floats) -> None:
        plain = value.tolist()
        self._resized |= name == "size" and plain != self._parameters.get((name, target), 1.0)
        self._parameters[name, target] = plain
        self._apply(name, target, plain)

    def save(self) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """Return Bullet's complete state, including the detected contacts."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "state.bullet")
            p.saveBullet(path, self.client)
            with open(path, "rb") as file:
                return np.frombuffer(file.read(), np.uint8)

    def load(self, state: np.ndarray[Any, np.dtype[np.uint8]], size: int, steps: int, broken: bool) -> None:
        """Restore a state that was saved by this world or by another world with the same configuration."""
        if self._broken and not broken:
            self.reset()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "state.bullet")
            with open(path, "wb") as file:
                file.write(state[:size].tobytes())
            p.restoreState(fileName=path, physicsClientId=self.client)
        self._steps, self._broken = int(steps), bool(broken)
        self._stop_pushing()
        for name, drive in self._drives.items():
            efforts = self._row[f"robots/{name}/efforts"].tolist()
            for slot, effort in zip(self.robots[name].slots, efforts, strict=True):
                drive.efforts[slot] = effort
        self._written()
