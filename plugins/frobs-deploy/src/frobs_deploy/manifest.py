"""Parses the part of ``bundle.json`` that is required to run the policy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_deploy.bundle import MANIFEST, Bundle
from frobs_deploy.errors import BundleError
from frobs_deploy.spaces import Array, Space, space_from_json


@dataclass(frozen=True, kw_only=True)
class Image:
    """An image in the observation, and the camera that was used during training.

    The image's observation space defines its shape, dtype and range of values.

    Attributes:
        camera: Name of the camera.
        modality: ``"rgb"`` or ``"depth"``.
        unit: Unit of the values: ``"1"``, or ``"m"`` for depth.
        frame: Frame that the camera is attached to, such as ``"robot/link"``, or None for the world frame.
        pos: Position of the camera in ``frame`` [m].
        target: Point that the camera looks at, in ``frame`` [m].
        fov_y: Vertical field of view [deg].
        markers: Whether the task's markers, such as the goal, were drawn into the image.
        intrinsics: ``fx``, ``fy``, ``cx`` and ``cy`` of an image of ``width`` × ``height`` [pixels], or None if the
            camera has square pixels and looks through the center of the image.
    """

    camera: str
    modality: str
    unit: str
    frame: str | None
    pos: tuple[float, float, float]
    target: tuple[float, float, float]
    fov_y: float
    markers: bool
    intrinsics: Mapping[str, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """Description of a policy's inputs and outputs.

    Attributes:
        observation: Space of each observation part, by key. The key is ``""`` if the observation is a single array.
        images: Description of each image, by its key in ``observation``.
        terms: Columns of each named term in the flat observation, or in the observation part ``"observation"``.
        action: Action space.
        max_action_change: Maximum change per step that the joints' velocity limits allow, in the action's shape and
            unit, or None if the actions are not joint positions.
        control_timestep: Time between two actions [s], or None if the environment does not specify it.
        joint_names: Joint names in the order of all joint arrays, or an empty tuple if the environment has no robot.
        robot: Fingerprint of the robot's model file, or None if the environment has no robot.
        xacro_args: Xacro arguments for the robot's model file.
    """

    observation: Mapping[str, Space]
    images: Mapping[str, Image]
    terms: Mapping[str, slice]
    action: Space
    max_action_change: Array | None
    control_timestep: float | None
    joint_names: tuple[str, ...]
    robot: str | None
    xacro_args: Mapping[str, str]


def read_manifest(bundle: Bundle) -> Manifest:
    """Parse the manifest of a bundle.

    Raises:
        BundleError: A value is missing or has the wrong type.
    """
    try:
        return _read(bundle.manifest)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else error
        raise BundleError(bundle.path, f"{MANIFEST} is damaged: {what}; export the policy again.") from error


def _read(data: Mapping[str, Any]) -> Manifest:
    observation, action, robot = data["observation"], data["action"], data["robot"]
    parts = {str(key): space_from_json(space) for key, space in observation["spaces"].items()}
    if not parts or ("" in parts and len(parts) > 1):
        raise ValueError("the observation has no parts, or one of several parts has no name")
    space = space_from_json(action["space"])
    timestep = data["control_timestep"]
    if timestep is not None and not 0.0 < float(timestep) < math.inf:
        raise ValueError(f"control_timestep is {timestep}")
    joints = [] if robot is None else robot["joints"]
    return Manifest(
        observation=parts,
        images={str(key): _image(row, parts[str(key)]) for key, row in observation.get("images", {}).items()},
        terms=_terms(observation["terms"], parts),
        action=space,
        max_action_change=_changes(action["max_change"], space),
        control_timestep=None if timestep is None else float(timestep),
        joint_names=tuple(str(joint["name"]) for joint in joints),
        robot=None if robot is None else str(robot["fingerprint"]),
        xacro_args={} if robot is None else {str(key): str(value) for key, value in robot["xacro_args"].items()},
    )


def _image(row: Mapping[str, Any], space: Space) -> Image:
    if len(space.shape) != 3:
        raise ValueError(f"an image has shape {space.shape}; expected (height, width, channels)")
    frame, lens = row["frame"], row.get("intrinsics")
    return Image(
        camera=str(row["camera"]),
        modality=str(row["modality"]),
        unit=str(row["unit"]),
        frame=None if frame is None else str(frame),
        pos=_point(row["pos"]),
        target=_point(row["target"]),
        fov_y=float(row["fov_y"]),
        markers=bool(row["markers"]),
        intrinsics=None if lens is None else {str(key): float(value) for key, value in lens.items()},
    )


def _point(values: Any) -> tuple[float, float, float]:
    x, y, z = map(float, values)
    return x, y, z


def _terms(rows: Any, parts: Mapping[str, Space]) -> dict[str, slice]:
    flat = parts.get("") or parts.get("observation")
    width = flat.shape[0] if flat is not None and len(flat.shape) == 1 else 0
    columns = {}
    for row in rows:
        first, last = (int(column) for column in row["columns"])
        if not 0 <= first <= last < width:
            raise ValueError(f"the observation has no columns {first} to {last}")
        columns[str(row["name"])] = slice(first, last + 1)
    return columns


def _changes(values: Any, space: Space) -> Array | None:
    if values is None:
        return None
    changes = np.array([math.inf if value is None else float(value) for value in values]).reshape(space.shape)
    if not (changes > 0.0).all():
        raise ValueError("max_change must be above 0")
    changes.setflags(write=False)
    return changes
