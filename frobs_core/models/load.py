"""Reads model files and meshes with the readers that plugins provide. The core reads no model file itself."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any, cast

from frobs_core import plugins
from frobs_core.models.model import Mesh, RobotModel
from frobs_core.plugins.records import ModelFormatRecord
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_core.util.install_hints import local_install_hint


def load_model(
    path: str | Path,
    *,
    xacro_args: Mapping[str, str] | None = None,
    package_paths: Mapping[str, str | Path] | None = None,
) -> RobotModel:
    """Read a robot's model file.

    Args:
        path: Path of the file, or ``"package:relative/path"`` for a file in an installed Python package. The suffix
            determines the format: with ``frobs-models``, ``.urdf``, ``.xacro`` (a URDF with macros), ``.xml`` or
            ``.mjcf`` (MJCF).
        xacro_args: Arguments for a xacro file.
        package_paths: Folders of the ROS packages that the file refers to, by package name. Packages beside or above
            the file, and packages in ``ROS_PACKAGE_PATH``, are found automatically.

    Returns:
        The robot's kinematic tree, with notes about everything that was changed or ignored.

    Raises:
        ModelFileError: The file, or a file that it refers to, is missing, empty, broken or contradictory, or declares a
            document type, or no installed plugin reads files with this suffix. The message includes the file name and
            the line number, and describes how to fix the problem.
        PluginError: The reader of this format cannot be imported.
    """
    model = find_reader(path).read(path, xacro_args=xacro_args, package_paths=package_paths)
    return cast(RobotModel, model)


def mesh_solid(mesh: Mesh) -> tuple[float, Floats, Floats]:
    """Return the volume [m³], the centroid (3,) [m], and the inertia about it for a mass of 1 kg, (3, 3) [m²]."""
    return cast(tuple[float, Floats, Floats], find_reader(mesh.path, "mesh").solid(mesh))


def is_model_file(path: str | Path) -> bool:
    """Return whether the suffix of a path is that of a robot's model file that an installed plugin reads."""
    return PurePath(path).suffix.lower() in _readable("robot")


def find_reader(path: str | Path, content: str = "robot") -> Any:
    """Return the :class:`~frobs_core.contracts.ModelReader` for a file, chosen by the suffix of the path.

    Args:
        path: Path of the file.
        content: ``"robot"`` or ``"mesh"``.

    Raises:
        ModelFileError: No installed plugin reads files with this suffix. The message names the package to install.
        PluginError: The reader cannot be imported.
    """
    suffix = PurePath(path).suffix.lower()
    records = _readable(content)
    if suffix in records:
        return records[suffix].load()()
    if not records:
        hint = local_install_hint("pip install frobs-models")
        raise ModelFileError(path, f"no installed plugin reads {content} files. To install one: {hint}.")
    raise ModelFileError(
        path, f"{content} files with the suffix '{suffix}' are not supported; use one of {', '.join(records)}."
    )


def _readable(content: str) -> dict[str, ModelFormatRecord]:
    """Return the records of formats by the suffixes of their files."""
    records = plugins.records(ModelFormatRecord).values()
    return {suffix: record for record in records if record.content == content for suffix in record.suffixes}
