"""Contract of readers of model files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

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

    def finger_links(self, model: RobotModel, joints: Sequence[str] = ()) -> Collection[str]:
        """Return the links of the fingers of a robot, which are never its default tool center point.

        Args:
            model: Model of the robot, as returned by :meth:`read`.
            joints: Joints of the gripper. If empty, a gripper is looked for.
        """
        return ()

    def describe_gripper(self, robot: Robot, stated: Mapping[str, Any]) -> dict[str, Any]:
        """Return the settings that completely state the gripper of a robot, for :meth:`with_gripper`.

        Args:
            robot: Description of an arm without joint groups.
            stated: Known properties of the gripper. The rest is found in the model file.

        Raises:
            UnsuitableRobotError: No gripper is recognized. The message contains the reason.
            ConfigurationError: A statement is invalid or contradicts the model file.
            ModelFileError: The model cannot be read.
        """
        raise UnsuitableRobotError(robot.name, "has a model file of a format in which grippers are not recognized.")

    def with_gripper(self, robot: Robot, stated: Mapping[str, Any] | None = None) -> Robot:
        """Return a robot with joint groups ``"arm"`` and ``"gripper"`` and an end effector, found in its model file.

        For arguments and errors, see :meth:`describe_gripper`. The other settings of the robot are kept.
        """
        raise UnsuitableRobotError(robot.name, "has a model file of a format in which grippers are not recognized.")

    def solid(self, mesh: Mesh) -> tuple[float, Floats, Floats]:
        """Return the volume [m³], the centroid (3,) [m], and the inertia about it for a mass of 1 kg, (3, 3) [m²].

        Raises:
            ModelFileError: The mesh cannot be read, or its surface is not closed.
        """
        raise ModelFileError(mesh.path, "has a format whose solids cannot be measured.")
