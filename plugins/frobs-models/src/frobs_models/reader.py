"""The reader of this distribution's formats."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy.typing as npt

from frobs_core.contracts import ModelReader
from frobs_core.description import Robot
from frobs_core.models import Mesh, RobotModel, Vector3
from frobs_core.util.arrays import Floats
from frobs_models.bounds import lowest_points
from frobs_models.load import read_model
from frobs_models.meshes.solid import mesh_solid
from frobs_models.mount import attach


class Reader(ModelReader):
    """Reads URDF, xacro and MJCF files, and meshes."""

    def read(
        self,
        path: str | Path,
        *,
        xacro_args: Mapping[str, str] | None = None,
        package_paths: Mapping[str, str | Path] | None = None,
    ) -> RobotModel:
        """Read a robot's model file."""
        return read_model(path, xacro_args=xacro_args, package_paths=package_paths)

    def lowest_points(
        self, model: RobotModel, joint_positions: npt.ArrayLike, quat_wxyz: npt.ArrayLike
    ) -> dict[str, float]:
        """Return the height of the lowest point of each link with collision shapes [m], by link name."""
        return lowest_points(model, joint_positions, quat_wxyz)

    def attach(self, arm: Robot, link: str, end_effector: Robot, name: str, pos: Vector3, rpy: Vector3) -> Robot:
        """Merge the files of an arm and an end effector."""
        return attach(arm, link, end_effector, name, pos, rpy)

    def solid(self, mesh: Mesh) -> tuple[float, Floats, Floats]:
        """Return the volume [m³], the centroid (3,) [m], and the inertia about it for a mass of 1 kg, (3, 3) [m²]."""
        return mesh_solid(mesh)
