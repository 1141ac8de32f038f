"""Replaces the cube of a task by an object from a file."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.description import Scene, Shape
from frobs_core.models import Pose
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.rotations import quat_from_matrix, quat_multiply
from frobs_core.util.validation import positive
from frobs_models import ObjectModel, read_object
from frobs_tasks_manipulation.grasps import FoundGrasp, find_grasp
from frobs_tasks_manipulation.tool import Grasp

_PAD = 0.005  # [m] torsional friction, as of a pad of soft rubber
_ABOVE = 0.02  # [m] distance of the fingertips from the top of the object before the tool moves down
_SMALLEST = 0.02  # [m] of the size that the reward uses
_TRIES = 12  # number of scales that are tried


class OwnObject:
    """An object from a file, and its grasp.

    The object's frame is where the tool grips the object: z points up, and the fingers close along the y axis. The
    object keeps the orientation of its file if it is stable on the floor and can be grasped from above. Otherwise, it is
    put on another side.

    Args:
        task: Task whose size, mass, heights and grasp are set, so that they fit the object.
        file: Path of the object.
        mass: Mass of the object [kg], or None for that of :func:`frobs_models.read_object`.
        scale: Factor for all lengths of the object.

    Attributes:
        model: The object.
        found: Its grasp.
        raised: Height at which the object is gripped above the height at which the cube would be gripped, ≥ 0 [m].

    Raises:
        ModelFileError: The file cannot be read, or the object is larger than 1 m.
        ConfigurationError: The object does not fit the gripper, or a value is out of range. The message contains the
            widths, and a scale at which the object fits.
    """

    def __init__(self, task: Any, file: str, mass: float | None, scale: float) -> None:
        scale = positive("object_scale", scale)
        self.model = read_object(file, scale=scale, mass=None if mass is None else positive("object_mass", mass, "kg"))
        hand: Grasp = task.grasp
        self.found = found = _fitting_grasp(self.model, hand, scale)
        self.raised = max(found.height - task.size / 2, 0.0)
        fingertips = found.height - hand.depth
        room = min(0.35 * (hand.gap[1] - found.width), 0.5 * (found.top - fingertips))
        task.grasp = replace(
            hand,
            turn=min(hand.turn, found.turn),
            aligned=float(np.clip(room, 0.002, hand.aligned)),
            clearance=max(hand.clearance, found.top - fingertips + _ABOVE),
        )
        task.size, task.rest_height, task.mass = max(found.width, _SMALLEST), found.height, self.model.mass
        task.start_height = max(task.start_height, found.top + hand.depth + _ABOVE)

    @classmethod
    def read(cls, task: Any, file: str | None, mass: float | None, scale: float) -> OwnObject | None:
        """Return the object that replaces a task's cube, or None without a file."""
        if file is not None:
            return cls(task, file, mass, scale)
        if mass is not None or scale != 1.0:
            raise ConfigurationError("object_mass and object_scale apply to an object from a file; set object=FILE.")
        return None

    def replace_in(self, scene: Scene, name: str) -> Scene:
        """Return a scene in which the object replaces the body with a name."""
        frame, own = self.found.rotation.T, self.model
        x, y, z = (frame @ (own.center_of_mass - self.found.pos)).tolist()
        inertia = frame @ own.inertia @ frame.T
        ixx, ixy, ixz, iyy, iyz, izz = inertia[np.triu_indices(3)].tolist()
        body = replace(
            scene.bodies[name],
            geometry=None,
            shapes=tuple(self._moved(shape) for shape in own.shapes),
            center_of_mass=(x, y, z),
            inertia=(ixx, ixy, ixz, iyy, iyz, izz),
            torsional_friction=_PAD,
        )
        return replace(scene, bodies={**scene.bodies, name: body})

    def _moved(self, shape: Shape) -> Shape:
        """Return a shape of the file in the frame of the grasp."""
        frame = self.found.rotation.T
        x, y, z = (frame @ (np.array(shape.pose.pos) - self.found.pos)).tolist()
        a, b, c, d = quat_multiply(quat_from_matrix(frame), np.array(shape.pose.quat_wxyz)).tolist()
        return replace(shape, pose=Pose((x, y, z), (a, b, c, d)))


def _fitting_grasp(own: ObjectModel, hand: Grasp, scale: float) -> FoundGrasp:
    """Return a grasp, or raise ConfigurationError if the object does not fit the gripper."""
    found, narrowest = find_grasp(own.points, own.center_of_mass, hand)
    if found is not None:
        return found
    extent = float(np.ptp(own.points, axis=0).max())
    last = 0.3 * hand.gap[1] / extent if extent > hand.gap[1] else 2.0 * hand.gap[1] / extent
    advice = "no other size fits"
    for share in np.linspace(0.0, 1.0, _TRIES + 1)[1:].tolist():
        factor = float(f"{scale * last**share:.3g}")
        if find_grasp(own.points * (factor / scale), own.center_of_mass * (factor / scale), hand)[0] is not None:
            advice = f"it fits with object_scale={factor:g} (option --object-scale)"
            break
    width = (
        f"its narrowest part is {1000 * narrowest:.0f} mm wide"
        if np.isfinite(narrowest)
        else "it has no sides for the fingers"
    )
    low, high = 1000 * hand.gap[0], 1000 * hand.gap[1]
    raise ConfigurationError(
        f"the object {own.file.name} cannot be grasped from above: {width}, and the gripper's gap is {low:.0f} to "
        f"{high:.0f} mm; {advice}."
    )
