"""Conversion of SDF models: a static model becomes bodies, and any other model becomes a robot."""

from __future__ import annotations

import copy
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element as PlainElement

from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Placement, Robot
from frobs_core.models import Pose
from frobs_core.util.errors import ModelFileError
from frobs_models import Element, Packages, parse_xml, read_urdf
from frobs_ros.bridge import LOG
from frobs_ros.bridge.gazebo_elements import SENSORS, read_lidars
from frobs_ros.bridge.model import Description, with_gains
from frobs_ros.bridge.poses import Place
from frobs_ros.bridge.sdf.reading import check, open_sdf, place_of, says
from frobs_ros.bridge.sdf.shapes import Shape, read_collision, read_visual
from frobs_ros.bridge.sdf.urdf import write_urdf


@dataclass(frozen=True)
class SdfLink:
    """A link of an SDF model.

    Attributes:
        place: Pose of the link in the model frame.
    """

    element: Element
    place: Place
    collisions: tuple[Shape, ...]
    visuals: tuple[Shape, ...]


def describe_sdf(text: str) -> Description:
    """Parse the single model in an SDF document.

    Raises:
        ModelFileError: The document does not contain exactly one model, or an element is not supported.
    """
    with tempfile.TemporaryDirectory() as folder:
        root = open_sdf(text, Path(folder, "spawned.sdf"))
        models = list(root.children("model"))
        if len(models) != 1 or root.child("world") is not None:
            root.refuse(f"the SDF file contains {len(models)} models; it must contain exactly one model and no world.")
        return describe_model(models[0])


def describe_model(model: Element, static: bool | None = None) -> Description:
    """Parse a ``<model>``.

    Raises:
        ModelFileError: An element is not supported.
    """
    passed_over = ("allow_auto_disable", "enable_wind", "meta", "gravity")
    check(model, ("pose", "static", "self_collide", "link", "joint", "plugin"), passed_over)
    links = {element.required("name"): _link(element) for element in model.children("link")}
    if not links:
        model.refuse("the model has no <link>; it must contain at least one.")
    if not says(model, "gravity", True):
        LOG.warning(
            "%s: <gravity> is ignored because SDF supports it only in a <link>; gravity acts on the model, as in "
            "Gazebo",
            model.named(),
        )
    is_static = says(model, "static") if static is None else static
    description = _standing(links, model) if is_static else _moving(links, model)
    return replace(description, pose=place_of(model).to_pose())


def _link(element: Element) -> SdfLink:
    passed_over = (
        "gravity",
        "velocity_decay",
        "self_collide",
        "kinematic",
        "enable_wind",
        "must_be_base_link",
        "audio",
    )
    check(element, ("pose", "inertial", "collision", "visual", "sensor"), passed_over)
    for tag, usual in (("gravity", True), ("kinematic", False)):
        if says(element, tag, usual) is not usual:
            element.refuse(f"<{tag}>{str(not usual).lower()}</{tag}> is not supported; remove it.")
    for sensor in element.children("sensor"):
        if sensor.get("type") not in SENSORS:
            sensor.refuse(
                f"a sensor of type '{sensor.get('type')}' is not supported; supported types: {', '.join(SENSORS)}."
            )
    return SdfLink(
        element,
        place_of(element),
        tuple(read_collision(each) for each in element.children("collision")),
        tuple(read_visual(each) for each in element.children("visual")),
    )


def _standing(links: dict[str, SdfLink], model: Element) -> Description:
    bodies = {}
    for name, link in links.items():
        colours = [visual.rgba for visual in link.visuals]
        shapes = link.collisions or link.visuals
        for number, shape in enumerate(shapes):
            bodies[f"{name}/{shape.name}"] = Body(
                geometry=shape.geometry,
                pose=shape.place.after(link.place).to_pose(),
                kinematic=True,
                collides=bool(link.collisions),
                friction=1.0 if shape.friction is None else shape.friction,
                rgba=colours[min(number, len(colours) - 1)] if colours else shape.rgba,
            )
    return Description(
        bodies=bodies,
        links={name: link.place.to_pose() for name, link in links.items()},
        elements=_elements(links, model),
    )


def _moving(links: dict[str, SdfLink], model: Element) -> Description:
    for name, link in links.items():
        if any(shape.is_ground for shape in link.collisions):
            link.element.refuse(f"the link '{name}' has a plane, but only links of static models can have planes.")
    urdf, offsets, fixed = write_urdf(links, model)
    file = model.file
    try:
        read = read_urdf(parse_xml(urdf, file, expanded=True), file, Packages(None, file))
    except ModelFileError as error:
        model.refuse(f"the model cannot be converted to a robot: {error.reason}")
    elements = _elements(links, model)
    friction = {name: max(given) for name, link in links.items() if (given := _frictions(link))}
    robot = Robot(
        model=str(file),
        name=read.name,
        base="fixed" if fixed else "floating",
        friction=friction,
        self_collision=says(model, "self_collide"),
    )
    robot = with_gains(replace(robot, sensors=read_lidars(elements)), read)
    own = {name: offset for name, place in offsets.items() if (offset := place.to_pose()) != Pose()}
    placement = Placement(robot=robot, model=read, command_mode=CommandMode.EFFORT)
    return Description(placement=placement, offsets=own, elements=elements)


def _frictions(link: SdfLink) -> list[float]:
    return [shape.friction for shape in link.collisions if shape.friction is not None]


def _elements(links: dict[str, SdfLink], model: Element) -> tuple[PlainElement, ...]:
    """Return the plugins and sensors as ``<gazebo>`` elements, the form that URDF files use."""
    elements = []
    for reference, holder, tags in [
        ("", model, ("plugin",)),
        *((name, link.element, ("sensor",)) for name, link in links.items()),
    ]:
        given = list(holder.children(*tags))
        if given:
            element = PlainElement("gazebo", {"reference": reference} if reference else {})
            element.extend(copy.deepcopy(each) for each in given)
            elements.append(element)
    return tuple(elements)
