"""Scene of a simulation: static bodies, and the cameras and contacts that the models' sensors require."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from frobs_core.description import Contact, Scene
from frobs_ros.bridge.camera_optics import camera_name, make_camera
from frobs_ros.bridge.model import Model


@dataclass(frozen=True)
class Touch:
    """Two parts between which contact is measured.

    Attributes:
        contact: Contact that the scene declares.
        first: Name of the first part, in Gazebo's format for collisions: ``"model::link::collision"``.
        second: Name of the second part.
    """

    contact: Contact
    first: str
    second: str

    @property
    def name(self) -> str:
        """Name of the contact in the scene."""
        return f"{self.contact.first} {self.contact.second}"


Touches: TypeAlias = Mapping[tuple[str, str], Sequence[Touch]]
"""Measured contact pairs of each link that has a contact sensor, keyed by model name and link name."""


def make_scene(
    models: Sequence[Model],
    touches: Touches,
    *,
    floor: bool,
    gravity: tuple[float, float, float],
    with_cameras: bool,
) -> Scene:
    """Return the scene, which contains everything except the moving models.

    Args:
        models: All models.
        touches: Pairs of parts between which contact is measured.
        floor: Whether the world has a ground plane at z = 0.
        gravity: [m/s²]
        with_cameras: Whether the simulator renders images.

    Raises:
        ConfigurationError: A camera has invalid parameters.
    """
    cameras = dict(Scene().cameras)  # the default camera is first, because the viewer window uses the first one
    if with_cameras:
        cameras |= {
            camera_name(model, sensor): make_camera(model, sensor)
            for model in models
            for sensor in model.sensors
            if sensor.is_camera and sensor.has_plugin
        }
    return Scene(
        floor=floor,
        gravity=gravity,
        bodies={name: body for model in models for name, body in model.static_bodies().items()},
        cameras=cameras,
        contacts={touch.name: touch.contact for each in touches.values() for touch in each},
    )


def find_touches(models: Sequence[Model], *, floor: bool) -> Touches:
    """Return the contact pairs to measure for each link that has a contact sensor.

    The sensor's link forms a separate pair with each link and each static shape that it can touch, so that the sensor
    can report which part is touched.

    Args:
        models: All models.
        floor: Whether the world has a ground plane.
    """
    return {
        (model.name, link): tuple(_touches(model, link, models, floor))
        for model in models
        for link in {sensor.link for sensor in model.sensors if sensor.kind == "contact" and sensor.has_plugin}
    }


def _touches(model: Model, link: str, models: Sequence[Model], floor: bool) -> Iterator[Touch]:
    others = [("floor", "ground_plane::link::collision")] if floor and not model.is_static else []
    for other in models:
        if model.is_static and other.is_static:
            continue
        if other is not model:
            others += [side for name in other.links for side in _sides(other, name)]
        elif model.description.placement is not None and model.description.placement.robot.self_collision:
            others += [side for name in model.links if name != link for side in _sides(model, name)]
    for first, first_name in _sides(model, link):
        for second, second_name in others:
            yield Touch(Contact(first=first, second=second), first_name, second_name)


def _sides(model: Model, link: str) -> list[tuple[str, str]]:
    """Return the colliding parts of a link and their Gazebo names, or an empty list if it has no collision shapes."""
    placement = model.description.placement
    if placement is None:
        shapes = [name for name in model.shapes if name.startswith(f"{link}/")]
        return [(f"{model.key}/{shape}", f"{model.name}::{shape.replace('/', '::')}") for shape in shapes]
    if not any(each.collisions for each in placement.model.links if each.name == link):
        return []
    return [(f"{model.key}/{link}", f"{model.name}::{link}::{link}_collision")]
