"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import ModelFormatRecord

_MESHES = (".stl", ".obj", ".dae", ".ply", ".off", ".glb", ".gltf")


def _record(name: str, summary: str, suffixes: tuple[str, ...], content: str = "robot") -> ModelFormatRecord:
    return ModelFormatRecord(
        name=name,
        summary=summary,
        suffixes=suffixes,
        content=content,
        entry_point="frobs_models.reader:Reader",
        install_hint="pip install frobs-models",
    )


@hookimpl
def frobs_extensions() -> list[ModelFormatRecord]:
    """Return the records of the formats."""
    return [
        _record("urdf", "URDF files of ROS", (".urdf",)),
        _record("xacro", "URDF files with macros", (".xacro",)),
        _record("mjcf", "files of MuJoCo", (".xml", ".mjcf")),
        _record("mesh", "triangle meshes: STL, OBJ, COLLADA, PLY, OFF and glTF", _MESHES, "mesh"),
    ]
