"""What an engine has built of a robot, in the words of the file: one small reader for each engine that we know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core import plugins
from frobs_core.interfaces import CommandMode, Placement, Robot, Scene, Simulation
from frobs_core.models import Pose, RobotModel


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


ENGINES = {"mujoco": Mujoco}
"""By simulator; of others only what every handle tells is compared."""


def matrix(quat_wxyz: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (…, 3, 3) of quaternions."""
    w, x, y, z = np.moveaxis(np.asarray(quat_wxyz, float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array([[np.asarray(c) for c in row] for row in rows]), (0, 1), (-2, -1))
