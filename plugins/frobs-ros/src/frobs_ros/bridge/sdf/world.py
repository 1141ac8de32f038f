"""SDF world files."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from frobs_models import Element, read_bytes
from frobs_ros.bridge import LOG
from frobs_ros.bridge.model import Description
from frobs_ros.bridge.poses import Place
from frobs_ros.bridge.sdf.model import describe_model
from frobs_ros.bridge.sdf.reading import check, find_model, number_of, numbers_of, open_sdf, place_of, says, text_of

_PASSED_OVER = ("scene", "gui", "state", "spherical_coordinates", "audio", "wind", "atmosphere", "magnetic_field")
_GROUND = ("model://ground_plane", "model://asphalt_plane")


@dataclass
class WorldFile:
    """A parsed world file.

    Attributes:
        floor: Whether the world has a ground plane at z = 0.
        gravity: [m/s²]
        timestep: Duration of a physics step [s].
        max_update_rate: Maximum number of physics steps per second [Hz], or 0 for no limit.
        models: Description and pose of each model, by name.
    """

    floor: bool = False
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.8)
    timestep: float = 0.001
    max_update_rate: float = 1000.0
    models: dict[str, tuple[Description, Place]] = field(default_factory=dict)
    lights: list[str] = field(default_factory=list)


def read_world(file: Path) -> WorldFile:
    """Read a world file.

    Raises:
        ModelFileError: The file is invalid, or an element is not supported.
    """
    root = open_sdf(read_bytes(file), file)
    world = root.child("world")
    if world is None:
        root.refuse("the SDF file contains no <world>.")
    check(world, ("include", "model", "light", "physics", "gravity", "plugin"), _PASSED_OVER)
    read = WorldFile()
    x, y, z = numbers_of(world, "gravity", "0 0 -9.8")
    physics = world.child("physics")
    if physics is not None:
        x, y, z = numbers_of(physics, "gravity", f"{x} {y} {z}")
        read.timestep = number_of(physics, "max_step_size", read.timestep)
        read.max_update_rate = number_of(physics, "real_time_update_rate", read.max_update_rate)
    read.gravity = x, y, z
    for plugin in world.children("plugin"):
        LOG.warning("%s: the world's plugin '%s' is ignored", file, plugin.get("filename"))
    for light in world.children("light"):
        read.lights.append(light.required("name"))
    for element in world.children("include", "model"):
        if element.tag == "include":
            _include(read, element)
        else:
            _add(read, element, element.required("name"), None, None)
    return read


def _include(read: WorldFile, include: Element) -> None:
    check(include, ("uri", "name", "pose", "static"))
    uri = text_of(include, "uri")
    if uri == "model://sun":
        read.lights.append("sun")
        return
    if uri in _GROUND:
        read.floor = True
        return
    file = find_model(uri, include)
    model = open_sdf(read_bytes(file), file).child("model")
    if model is None:
        include.refuse(f"the included file {file} contains no <model>.")
    static = says(include, "static") if include.child("static") is not None else None
    place = place_of(include) if include.child("pose") is not None else None
    _add(read, model, text_of(include, "name") or model.required("name"), static, place)


def _add(read: WorldFile, model: Element, name: str, static: bool | None, place: Place | None) -> None:
    if name in read.models:
        model.refuse(f"the world already contains a model named '{name}'; rename one of the two models.")
    if _is_ground(model):
        read.floor = True
        return
    read.models[name] = describe_model(model, static), place_of(model) if place is None else place


def _is_ground(model: Element) -> bool:
    """Return whether a model is the ground plane that Gazebo writes into saved worlds."""
    shapes = [shape for collision in model.iter("collision") for shape in collision.iter("geometry")]
    flat = bool(shapes) and all(shape.find("plane") is not None for shape in shapes)
    poses = [(pose.text or "").split() for pose in model.iter("pose")]
    return flat and says(model, "static") and all(float(word) == 0.0 for pose in poses for word in pose)
