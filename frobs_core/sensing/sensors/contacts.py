"""Contacts that a simulation monitors for its robots' sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from frobs_core.description import Placement, Scene
from frobs_core.sensing.sensors.instrument import instrument_of


def with_contacts(scene: Scene, robots: Mapping[str, Placement]) -> Scene:
    """Return a copy of a scene that includes the contacts required by its robots' sensors.

    Args:
        scene: Scene of the task.
        robots: Robots, by name.

    Raises:
        PluginError: A sensor's instrument cannot be imported.
    """
    needed = {
        contact: declared
        for robot, placement in robots.items()
        for name, sensor in placement.robot.sensors.items()
        for contact, declared in instrument_of(sensor).contacts(name, sensor, robot, scene).items()
    }
    return replace(scene, contacts={**scene.contacts, **needed}) if needed else scene
