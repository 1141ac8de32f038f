"""Cameras that users add to a task's scene, or change, with the ``cameras`` keyword."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from math import degrees
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field  # noqa: TID253 - only imported if cameras are given

from frobs_core.description import Camera, Intrinsics, Placement, Scene
from frobs_core.util.errors import ConflictingOptionsError, MissingSettingError, ParameterValueError, check_name
from frobs_core.util.validation import validate

_NARROWEST = 0.01  # [deg] with a much smaller field of view, PyBullet draws without end
_Point = tuple[float, float, float]


class _Settings(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class _Lens(_Settings):
    fx: Annotated[float, Field(gt=0.0)]
    fy: Annotated[float, Field(gt=0.0)]
    cx: float
    cy: float
    width: Annotated[int, Field(ge=1)]
    height: Annotated[int, Field(ge=1)]


class _Camera(_Settings):
    robot: str | None = None
    link: str | None = None
    body: str | None = None
    pos: _Point | None = None
    target: _Point | None = None
    up: _Point | None = None
    fov_y: Annotated[float, Field(gt=0.0, lt=180.0)] | None = None
    intrinsics: _Lens | None = None


def with_cameras(
    scene: Scene, given: Mapping[str, Any], robots: Mapping[str, Placement], mounted: Collection[str] = ()
) -> Scene:
    """Return a scene with the cameras that the user adds or changes.

    Args:
        scene: Scene of the task.
        given: Settings of each camera, by name. Settings of a camera that the scene already has change that camera.
        robots: All robots of the simulation, the controlled ones first.
        mounted: Names of the cameras that robots bring along. Settings with a position and a target replace them.

    Raises:
        ConfigurationError: A setting is unknown, missing or invalid, or two settings contradict each other.
        UnknownNameError: A robot, link or body does not exist.
    """
    cameras = dict(scene.cameras)
    for name, settings in given.items():
        owner = f"cameras.{name}"
        if not isinstance(settings, Mapping):
            raise ParameterValueError(owner, settings, f"a mapping with some of {', '.join(_Camera.model_fields)}")
        read = validate(_Camera, settings, owner)
        for first, second in (("link", "body"), ("robot", "body"), ("fov_y", "intrinsics")):
            if getattr(read, first) is not None and getattr(read, second) is not None:
                raise ConflictingOptionsError([f"{owner}.{first}", f"{owner}.{second}"])
        changes: dict[str, Any] = read.model_dump(include={"pos", "target", "up", "fov_y"}, exclude_none=True)
        if read.intrinsics is not None or read.fov_y is not None:
            changes["intrinsics"] = read.intrinsics and Intrinsics(**read.intrinsics.model_dump())
        if {"robot", "link", "body"} & read.model_fields_set:
            changes["frame"] = _frame(owner, read, scene, robots)
        is_complete = {"pos", "target"} <= changes.keys()
        if is_complete and name in mounted:
            del cameras[name]
        if name not in cameras and not is_complete:
            known = ", ".join(scene.cameras) or "none"
            raise MissingSettingError(owner, "pos and target", f"only cameras of the scene have defaults: {known}")
        cameras[name] = camera = replace(cameras[name], **changes) if name in cameras else Camera(**changes)
        if tuple(camera.pos) == tuple(camera.target):
            raise ParameterValueError(f"{owner}.target", camera.target, "a point other than the camera's pos")
        lens = camera.intrinsics
        narrowest = min(camera.fov_y, 180.0 if lens is None else degrees(lens.width / lens.fx))
        if narrowest < _NARROWEST:
            raise ParameterValueError(f"{owner}: field of view", narrowest, f"at least {_NARROWEST:g} degrees")
    return replace(scene, cameras=cameras)


def _frame(owner: str, read: _Camera, scene: Scene, robots: Mapping[str, Placement]) -> str | None:
    """Return what the camera is fixed to: ``"robot/link"``, the name of a body, or None for the world."""
    if read.body is not None:
        return check_name(f"body of the scene ({owner}.body)", read.body, scene.bodies)
    robot = next(iter(robots)) if read.robot is None else read.robot
    check_name(f"robot of the scene ({owner}.robot)", robot, robots)
    if read.link is None:
        if read.robot is not None:
            raise MissingSettingError(owner, "link", "name the link that carries the camera")
        return None
    links = [link.name for link in robots[robot].model.links]
    link = check_name(f"link of robot '{robot}' ({owner}.link)", read.link, links)
    return f"{robot}/{link}"
