"""Cameras that users add to a task's scene, or change, with the ``cameras`` keyword."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from frobs_core.description import Camera, Intrinsics, Placement, Scene
from frobs_core.plugins.records import Level
from frobs_core.util.errors import (
    ConflictingOptionsError,
    MissingSettingError,
    ParameterValueError,
    UnknownNameError,
    UnknownParameterError,
)
from frobs_core.util.validation import finite, number_list, positive, whole_number

_KEYS = ("robot", "link", "body", "pos", "target", "up", "fov_y", "intrinsics")
_INTRINSICS = [field.name for field in fields(Intrinsics)]


def with_cameras(scene: Scene, given: Mapping[str, Any], robots: Mapping[str, Placement]) -> Scene:
    """Return a scene with the cameras that the user adds or changes.

    Args:
        scene: Scene of the task.
        given: Settings of each camera, by name. Settings of a camera that the scene already has change that camera.
        robots: All robots of the simulation, the controlled ones first.

    Raises:
        ConfigurationError: A setting is unknown, missing or invalid, or two settings contradict each other.
        UnknownNameError: A robot, link or body does not exist.
    """
    if not given:
        return scene
    cameras = dict(scene.cameras)
    for name, settings in given.items():
        cameras[name] = _camera(f"cameras.{name}", settings, cameras.get(name), scene, robots)
    return replace(scene, cameras=cameras)


def capabilities_for_cameras(scene: Scene, given: Mapping[str, Any]) -> dict[str, dict[str, Level]]:
    """Return the capabilities that the user's cameras, and all cameras with intrinsics, require of the simulator."""
    needs = {f"cameras.{name}": {"cameras": Level.APPROXIMATE} for name in given}
    for name, camera in scene.cameras.items():
        if camera.intrinsics is not None:
            needs.setdefault(f"cameras.{name}", {})["camera_intrinsics"] = Level.APPROXIMATE
    return needs


def _camera(
    owner: str, settings: Any, existing: Camera | None, scene: Scene, robots: Mapping[str, Placement]
) -> Camera:
    if not isinstance(settings, Mapping):
        raise ParameterValueError(owner, settings, f"a mapping with some of the settings {', '.join(_KEYS)}")
    for key in settings:
        if key not in _KEYS:
            raise UnknownParameterError(owner, str(key), _KEYS)
    for first, second in (("link", "body"), ("robot", "body"), ("fov_y", "intrinsics")):
        if settings.get(first) is not None and settings.get(second) is not None:
            raise ConflictingOptionsError([f"{owner}.{first}", f"{owner}.{second}"])
    if settings.get("robot") is not None and settings.get("link") is None:
        raise MissingSettingError(owner, "'link'", "set the robot's link that carries the camera")
    changes: dict[str, Any] = {
        key: number_list(f"{owner}.{key}", settings[key], 3)
        for key in ("pos", "target", "up")
        if settings.get(key) is not None
    }
    if not {"link", "body"}.isdisjoint(settings):
        changes["frame"] = _frame(owner, settings, scene, robots)
    if settings.get("fov_y") is not None:
        changes |= {"fov_y": positive(f"{owner}.fov_y", settings["fov_y"], "deg"), "intrinsics": None}
        if changes["fov_y"] >= 180.0:
            raise ParameterValueError(f"{owner}.fov_y", settings["fov_y"], "below 180 [deg]")
    if settings.get("intrinsics") is not None:
        changes["intrinsics"] = _intrinsics(f"{owner}.intrinsics", settings["intrinsics"])
    if existing is None and not {"pos", "target"} <= changes.keys():
        known = ", ".join(scene.cameras) or "none"
        raise MissingSettingError(owner, "'pos' and 'target'", f"only the scene's cameras have defaults: {known}")
    camera = Camera(**changes) if existing is None else replace(existing, **changes)
    if tuple(camera.pos) == tuple(camera.target):
        raise ParameterValueError(f"{owner}.target", list(camera.target), "a point other than the camera's pos")
    return camera


def _frame(owner: str, settings: Mapping[str, Any], scene: Scene, robots: Mapping[str, Placement]) -> str | None:
    """Return what the camera is fixed to: ``"robot/link"``, the name of a body, or None for the world."""
    link, body = settings.get("link"), settings.get("body")
    if body is not None:
        if body not in scene.bodies:
            raise UnknownNameError(f"body of the scene ({owner}.body)", str(body), scene.bodies)
        return str(body)
    if link is None:
        return None
    robot = settings.get("robot") or next(iter(robots))
    if robot not in robots:
        raise UnknownNameError(f"robot of the scene ({owner}.robot)", str(robot), robots)
    links = [each.name for each in robots[robot].model.links]
    if link not in links:
        raise UnknownNameError(f"link of robot '{robot}' ({owner}.link)", str(link), links)
    return f"{robot}/{link}"


def _intrinsics(owner: str, given: Any) -> Intrinsics:
    if not isinstance(given, Mapping):
        raise ParameterValueError(owner, given, f"a mapping with {', '.join(_INTRINSICS)} [pixels]")
    for key in given:
        if key not in _INTRINSICS:
            raise UnknownParameterError(owner, str(key), _INTRINSICS)
    missing = [key for key in _INTRINSICS if key not in given]
    if missing:
        raise MissingSettingError(owner, ", ".join(missing), f"set all of {', '.join(_INTRINSICS)} [pixels]")
    return Intrinsics(
        fx=positive(f"{owner}.fx", given["fx"], "pixels"),
        fy=positive(f"{owner}.fy", given["fy"], "pixels"),
        cx=finite(f"{owner}.cx", given["cx"], "pixels"),
        cy=finite(f"{owner}.cy", given["cy"], "pixels"),
        width=whole_number(f"{owner}.width", given["width"], 1),
        height=whole_number(f"{owner}.height", given["height"], 1),
    )
