"""What an engine has built of a robot, in the words of the file: one small reader for each engine that we know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core import plugins
from frobs_core.contracts import CommandMode, Simulation
from frobs_core.description import Placement, Robot, Scene
from frobs_core.models import JointType, Pose, RobotModel
from frobs_core.util.rotations import quat_from_matrix


@dataclass(eq=False)
class BuiltLink:
    """Mass [kg], centre of mass [m] and inertia [kg·m²] in the link's axes, and the box around what collides [m]."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    box: tuple[np.ndarray, np.ndarray] | None


@dataclass(eq=False)
class BuiltJoint:
    """A joint: ``revolute`` or ``prismatic``, its axis and its range, infinite where it has none."""

    type: str
    axis: np.ndarray
    range: tuple[float, float]


def build(simulator: str, model: RobotModel, num_envs: int, **description: Any) -> Simulation:
    """Build a robot alone in the world, standing at its origin."""
    robot = Robot(model=str(model.path), name=model.name, **description)
    placement = Placement(robot=robot, model=model, pose=Pose(), command_mode=CommandMode.POSITION)
    scene = Scene(floor=False)
    return plugins.get_record("simulator", simulator).load()(
        {"robot": placement}, scene, num_envs=num_envs, physics_timestep=0.002, num_threads=1
    )


class Mujoco:
    """The compiled model."""

    box_is_exact = True

    def __init__(self, simulation: Any) -> None:
        self._model = simulation.native.model

    def link(self, name: str) -> BuiltLink:
        body = self._model.body(f"robot/{name}")
        axes = matrix(body.iquat)
        corners = [corner for geom in range(*self._geoms(body)) for corner in self._corners(geom)]
        return BuiltLink(
            mass=float(body.mass[0]),
            centre=body.ipos,
            inertia=axes @ np.diag(body.inertia) @ axes.T,
            box=(np.min(corners, axis=0), np.max(corners, axis=0)) if corners else None,
        )

    def joint(self, name: str) -> BuiltJoint:
        joint = self._model.joint(f"robot/{name}")
        limited = bool(self._model.jnt_limited[joint.id])
        return BuiltJoint(
            type={2: "prismatic", 3: "revolute"}[int(joint.type[0])],
            axis=joint.axis,
            range=tuple(joint.range.tolist()) if limited else (-np.inf, np.inf),
        )

    def mimics(self) -> dict[str, tuple[str, float, float]]:
        """Return what each joint follows, with multiplier and offset."""
        m, found = self._model, {}
        for i in range(m.neq):
            names = [m.joint(m.eq_obj1id[i]).name, m.joint(m.eq_obj2id[i]).name]
            follower, leader = (name.removeprefix("robot/") for name in names)
            found[follower] = (leader, float(m.eq_data[i, 1]), float(m.eq_data[i, 0]))
        return found

    def _geoms(self, body: Any) -> tuple[int, int]:
        first = int(body.geomadr[0])
        return first, first + int(body.geomnum[0])

    def _corners(self, geom: int) -> np.ndarray:
        m = self._model
        if not m.geom_contype[geom]:
            return np.zeros((0, 3))
        rotation, origin, size = matrix(m.geom_quat[geom]), m.geom_pos[geom], m.geom_size[geom]
        along = np.abs(rotation[:, 2])
        match int(m.geom_type[geom]):
            case 7:
                mesh = m.mesh(int(m.geom_dataid[geom]))
                first = int(mesh.vertadr[0])
                vertices = m.mesh_vert[first : first + int(mesh.vertnum[0])]
                points = origin + vertices @ rotation.T
                return np.stack([points.min(axis=0), points.max(axis=0)])
            case 6:
                half = np.abs(rotation) @ size
            case 5:
                half = along * size[1] + size[0] * np.sqrt(1 - np.minimum(along, 1) ** 2)
            case 3:
                half = along * size[1] + size[0]
            case _:
                half = np.full(3, size[0])
        return np.stack([origin - half, origin + half])


class Pybullet:
    """Bullet's body. A link that weighs nothing and has no shape is none; of a fixed base Bullet forgets the mass."""

    box_is_exact = False  # Bullet boxes the boxes of a link's shapes, in their own axes, and adds margins

    def __init__(self, simulation: Any) -> None:
        import pybullet

        native = simulation.native[0]
        self._p, self._client, self._body = pybullet, native.client, native.robots["robot"]
        self._model = simulation.robots["robot"].model
        self._links, self._joints = {self._model.root: -1}, {}
        for i in range(pybullet.getNumJoints(self._body, self._client)):
            info = pybullet.getJointInfo(self._body, i, self._client)
            self._links[info[12].decode()] = self._joints[info[1].decode()] = i

    def link(self, name: str) -> BuiltLink | None:
        if name not in self._links:
            return BuiltLink(0.0, np.zeros(3), np.zeros((3, 3)), None)
        index = self._links[name]
        dynamics = self._p.getDynamicsInfo(self._body, index, self._client)
        pose = _transform(dynamics[3], dynamics[4])
        axes = pose[:3, :3]
        return BuiltLink(
            mass=float("nan") if index < 0 else dynamics[0],
            centre=pose[:3, 3],
            inertia=axes @ np.diag(dynamics[2]) @ axes.T if index >= 0 else np.full((3, 3), np.nan),
            box=self._box(index, pose),
        )

    def joint(self, name: str) -> BuiltJoint:
        info = self._p.getJointInfo(self._body, self._joints[name], self._client)
        kind = {self._p.JOINT_REVOLUTE: "revolute", self._p.JOINT_PRISMATIC: "prismatic"}[info[2]]
        com = self._p.getDynamicsInfo(self._body, self._joints[name], self._client)[3:5]
        axis = _transform(*com)[:3, :3] @ np.array(info[13])  # Bullet tells it in the axes of the inertia
        if info[8] >= info[9]:
            return BuiltJoint(kind, axis, (-np.inf, np.inf))
        from frobs_sim_pybullet.urdf import NET

        net = NET[JointType(kind)]  # Bullet's own limits are so far beyond: the drive law holds joints at theirs
        return BuiltJoint(kind, axis, (info[8] + net, info[9] - net))

    def mimics(self) -> dict[str, tuple[str, float, float]]:
        """Return nothing: the drive law moves what mimics, which the kinematics show."""
        return {}

    def _box(self, link: int, com: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Turn the robot so that the link's axes are the world's, and ask for the box around it."""
        if not self._p.getCollisionShapeData(self._body, link, self._client):
            return None
        place = self._p.getBasePositionAndOrientation(self._body, self._client)
        base = _transform(*place)
        if link < 0:
            frame = base @ np.linalg.inv(com)
        else:
            frame = _transform(*self._p.getLinkState(self._body, link, 0, 1, self._client)[:2]) @ np.linalg.inv(com)
        turned = np.linalg.inv(frame) @ base
        quat_wxyz = quat_from_matrix(turned[:3, :3])
        self._p.resetBasePositionAndOrientation(self._body, turned[:3, 3], quat_wxyz[[1, 2, 3, 0]], self._client)
        self._p.performCollisionDetection(self._client)
        low, high = self._p.getAABB(self._body, link, self._client)
        self._p.resetBasePositionAndOrientation(self._body, *place, self._client)
        return np.array(low), np.array(high)


ENGINES = {"mujoco": Mujoco, "pybullet": Pybullet}
"""By simulator; of others only what every handle tells is compared."""


def _transform(pos: Any, quat_xyzw: Any) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = matrix(np.array(quat_xyzw)[[3, 0, 1, 2]]), pos
    return pose


def matrix(quat_wxyz: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (…, 3, 3) of quaternions."""
    w, x, y, z = np.moveaxis(np.asarray(quat_wxyz, float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array([[np.asarray(c) for c in row] for row in rows]), (0, 1), (-2, -1))
