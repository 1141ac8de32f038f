"""Reads URDF, xacro and MJCF files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from frobs_core.models import RobotModel
from frobs_core.util.errors import ModelFileError
from frobs_models.mjcf.mjcf import read_mjcf
from frobs_models.resources import Packages, resolve_path
from frobs_models.urdf.urdf import read_urdf
from frobs_models.xacro.files import read_text
from frobs_models.xmltree import Element, parse_xml

ENDINGS = (".urdf", ".xacro", ".xml", ".mjcf")
"""Suffixes of model files."""


def read_model(
    path: str | Path,
    *,
    xacro_args: Mapping[str, str] | None = None,
    package_paths: Mapping[str, str | Path] | None = None,
) -> RobotModel:
    """Read a robot's model file.

    Args:
        path: Path of the file, or ``"package:relative/path"`` for a file in an installed Python package. The suffix
            determines the format: ``.urdf``, ``.xacro`` (a URDF with macros), ``.xml`` or ``.mjcf`` (MJCF).
        xacro_args: Arguments for a xacro file.
        package_paths: Folders of the ROS packages that the file refers to, by package name. Packages beside or above
            the file, and packages in ``ROS_PACKAGE_PATH``, are found automatically.

    Returns:
        The robot's kinematic tree, with notes about everything that was changed or ignored.

    Raises:
        ModelFileError: The file, or a file that it refers to, is missing, empty, broken or contradictory, or declares a
            document type. The message includes the file name and the line number, and describes how to fix the problem.
    """
    return read_document(*open_document(path, xacro_args=xacro_args, package_paths=package_paths))


def open_document(
    path: str | Path,
    *,
    xacro_args: Mapping[str, str] | None = None,
    package_paths: Mapping[str, str | Path] | None = None,
) -> tuple[Element, Path, Packages]:
    """Parse a model file and expand its macros. For the arguments, see :func:`frobs_core.models.load_model`.

    Returns:
        The root element, the file's absolute path, and the locations of the packages that the file refers to.

    Raises:
        ModelFileError: The file is missing, empty or broken.
    """
    file = resolve_path(path)
    if file.is_dir():
        raise ModelFileError(file, "the path is a folder; pass the path of a model file.")
    if not file.is_file():
        raise ModelFileError(file, "the path does not refer to a regular file; pass the path of a model file.")
    if file.suffix.lower() not in ENDINGS:
        raise ModelFileError(
            file, f"model files with the suffix '{file.suffix}' are not supported; use one of {', '.join(ENDINGS)}."
        )
    packages = Packages(package_paths, file)
    text, expanded = read_text(file, xacro_args or {}, packages)
    return parse_xml(text, file, expanded=expanded), file, packages


def read_document(root: Element, file: Path, packages: Packages) -> RobotModel:
    """Read a parsed document.

    Raises:
        ModelFileError: The document is contradictory or does not describe a robot.
    """
    if root.tag == "robot":
        return read_urdf(root, file, packages)
    if root.tag == "mujoco":
        return read_mjcf(root, file)
    return root.refuse("the root element must be <robot> (URDF) or <mujoco> (MJCF).")
