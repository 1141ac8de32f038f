"""Reads the URDF or xacro file of a package's robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from frobs_core.description import Lidar
from frobs_core.models import RobotModel, default_tcp, forward_kinematics, load_model
from frobs_core.util.errors import FrobsError
from frobs_models import Packages
from frobs_rl_compat.migrate.package import OldPackage
from frobs_ros import gazebo_elements, read_friction, read_lidars, read_plugins

_DRIVE_TAGS = {
    "left": ("leftJoint", "left_wheel_joint_name", "left_wheel", "left_joint"),
    "right": ("rightJoint", "right_wheel_joint_name", "right_wheel", "right_joint"),
    "separation": ("wheelSeparation", "wheel_separation"),
    "diameter": ("wheelDiameter", "wheel_diameter"),
}
"""Names of the XML elements that contain each parameter of Gazebo's differential-drive plugins."""


@dataclass(frozen=True)
class Wheels:
    """Two driven wheels, as described by a Gazebo plugin."""

    left: str
    right: str
    separation: float  # [m] distance between the wheels
    diameter: float  # [m] diameter of each wheel


@dataclass(frozen=True)
class RobotSource:
    """A robot's model file and the information read from it."""

    path: Path
    xacro_args: Mapping[str, str]
    package_paths: Mapping[str, str | Path]  # folders of ROS packages that the file may refer to
    model: RobotModel
    wheels: Wheels | None  # driven wheels of a differential-drive robot
    friction: Mapping[str, float]  # sliding friction coefficient of each link for which the file defines friction
    lidars: Mapping[str, Lidar]
    lidar_problem: str = ""  # reason why the file's lidars cannot be used

    @property
    def base_link(self) -> str:
        """Link that represents the whole robot: ``base_link`` if it exists, or else the root link."""
        links = [link.name for link in self.model.links]
        return "base_link" if "base_link" in links else links[0]

    @property
    def still_axes(self) -> str:
        """Axes of the root link along which the tool never moves, such as ``"z"`` for a horizontal planar arm."""
        postures = np.random.default_rng(0).uniform(-1.0, 1.0, (64, len(self.model.joint_names)))
        spread = np.ptp(forward_kinematics(self.model, default_tcp(self.model), postures)[0], axis=0)
        return "".join(axis for axis, wide in zip("xyz", spread, strict=True) if wide < 1e-9)


def find_robot(package: OldPackage, package_paths: Mapping[str, str | Path]) -> tuple[RobotSource | None, str]:
    """Return the robot that the package spawns, or None and the reason why the robot cannot be used."""
    arguments = package.robot_arguments
    file = arguments.get("urdf_file")
    if not file:
        return None, "no constructor states the argument urdf_file of RobotBasicEnv as a literal"
    paths = {package.name: package.folder, **package_paths}
    args = dict(arg.partition(":=")[::2] for arg in arguments.get("urdf_xacro_args") or () if ":=" in arg)
    try:
        home = Packages(paths, package.folder.absolute() / "package.xml").find(
            arguments.get("pkg_name") or package.name
        )
        path = Path(home) / str(arguments.get("urdf_folder", "/urdf")).strip("/") / str(file)
        model = load_model(path, xacro_args=args, package_paths=paths)
        elements = gazebo_elements(model)
        friction = read_friction(elements, model)
    except FrobsError as error:
        return None, str(error)
    lidars, problem = {}, ""
    try:
        lidars = read_lidars(elements)
    except FrobsError as error:
        problem = str(error)
    return RobotSource(path, args, paths, model, _wheels(model), friction, lidars, problem), ""


def _wheels(model: RobotModel) -> Wheels | None:
    for plugin in read_plugins(ElementTree.fromstring(model.xml).iter("gazebo")):
        texts = {what: next(filter(None, map(plugin.text, tags)), "") for what, tags in _DRIVE_TAGS.items()}
        if all(texts.values()):
            try:
                sizes = float(texts["separation"]), float(texts["diameter"])
            except ValueError:
                continue
            return Wheels(texts["left"], texts["right"], *sizes)
    return None
