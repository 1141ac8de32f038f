"""Contract of readers of model files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path

import numpy.typing as npt

from frobs_core.description.robot import Robot
from frobs_core.models.model import Mesh, RobotModel, Vector3
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError, UnsuitableRobotError


class ModelReader(ABC):
    """Reads the model files of one format, and the meshes that they name. A reader is created without arguments."""

    @abstractmethod
    def read(
        self,
        path: str | Path,
        *,
        xacro_args: Mapping[str, str] | None = None,
        package_paths: Mapping[str, str | Path] | None = None,
    ) -> RobotModel:
        """Read a robot's model file. For arguments and errors, see :func:`frobs_core.models.load_model`."""

    @abstractmethod
    def lowest_points(
        self, model: RobotModel, joint_positions: npt.ArrayLike, quat_wxyz: npt.ArrayLike
    ) -> dict[str, float]:
        """Return the height of the lowest point of each link with collision shapes [m].

        Args:
            model: Model of the robot, as returned by :meth:`read`.
            joint_positions: (dof,) [rad or m]
            quat_wxyz: Orientation of the root link in the world frame, (4,), scalar first.

        Returns:
            Heights relative to the root link's origin, by link name.
        """

    def attach(self, arm: Robot, link: str, tool: Robot, name: str, pos: Vector3, rpy: Vector3) -> Robot:
        """Attach an end effector. For arguments and errors, see :meth:`frobs_core.description.Robot.attach`."""
        raise UnsuitableRobotError(arm.name, "has a model file of a format that does not support end effectors.")

    def solid(self, mesh: Mesh) -> tuple[float, Floats, Floats]:
        """Return the volume [m³], the centroid (3,) [m], and the inertia about it for a mass of 1 kg, (3, 3) [m²].

        Raises:
            ModelFileError: The mesh cannot be read, or its surface is not closed.
        """
        raise ModelFileError(mesh.path, "has a format whose solids cannot be measured.")
