"""Reading a model file, whatever its format."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from frobs_core.errors import ModelFileError
from frobs_core.models.mjcf import read_mjcf
from frobs_core.models.model import RobotModel
from frobs_core.models.resources import Packages, resolve_path
from frobs_core.models.urdf import read_urdf
from frobs_core.models.xacro_files import read_text
from frobs_core.models.xmltree import Element, parse_xml

ENDINGS = (".urdf", ".xacro", ".xml", ".mjcf")
"""Of model files."""


def load_model(
    path: str | Path,
    *,
    xacro_args: Mapping[str, str] | None = None,
    package_paths: Mapping[str, str | Path] | None = None,
) -> RobotModel:
    """Read a robot's model file.

    Args:
        path: A file, or ``"package:relative/path"`` inside an installed Python package. The ending says what it is:
            ``.urdf``, ``.xacro`` (a URDF with macros), ``.xml`` or ``.mjcf`` (MJCF).
        xacro_args: Arguments of a xacro file.
        package_paths: Folders of the ROS packages that the file names, by package name; packages beside or above
            the file and in ``ROS_PACKAGE_PATH`` are found without.

    Returns:
        The robot's kinematic tree, with a note for each thing that was changed or left out.

    Raises:
        ModelFileError: The file, or one that it refers to, is missing, empty or broken, says something
            impossible, or declares a document type; the message names the file, the line and what to do.
    """
    return read_document(*open_document(path, xacro_args=xacro_args, package_paths=package_paths))


def open_document(
    path: str | Path,
    *,
    xacro_args: Mapping[str, str] | None = None,
    package_paths: Mapping[str, str | Path] | None = None,
) -> tuple[Element, Path, Packages]:
    """Parse a model file, macros expanded; the arguments are those of :func:`load_model`.

    Returns:
        Its first element, its absolute path, and where the packages are that it names.

    Raises:
        ModelFileError: It is missing, empty or broken.
    """
    file = resolve_path(path)
    if file.is_dir():
        raise ModelFileError(file, "is a folder; name the file in it.")
    if not file.is_file():
        raise ModelFileError(file, "is not a regular file, and only those are opened.")
    if file.suffix.lower() not in ENDINGS:
        raise ModelFileError(file, f"the ending '{file.suffix}' is of no model file; there are {', '.join(ENDINGS)}.")
    packages = Packages(package_paths, file)
    text, expanded = read_text(file, xacro_args or {}, packages)
    return parse_xml(text, file, expanded=expanded), file, packages


def read_document(root: Element, file: Path, packages: Packages) -> RobotModel:
    """Read what was parsed.

    Raises:
        ModelFileError: It says something impossible, or is no robot.
    """
    if root.tag == "robot":
        return read_urdf(root, file, packages)
    if root.tag == "mujoco":
        return read_mjcf(root, file)
    return root.refuse("the first element must be <robot> (URDF) or <mujoco> (MJCF).")
