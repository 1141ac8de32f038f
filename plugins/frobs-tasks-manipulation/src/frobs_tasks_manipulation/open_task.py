"""Base class of tasks in which a piece of furniture must be opened by its handle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Snapshot
from frobs_core.description import Camera, ObservationTerm, Prop, Scene
from frobs_core.models import Pose
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ResetOptionError
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import matrix_from_quat, quat_from_axis_angle, quat_rotate
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.manipulation import FLOOR_FRICTION, Manipulation
from frobs_tasks_manipulation.observed import bounded
from frobs_tasks_manipulation.rewards import length, nearness

HANDLE = "handle"
_TURN = 0.15
"""Maximum initial rotation of the furniture about the vertical axis [rad]."""


class OpenTask(Manipulation):
    """Base class of tasks in which the joint of a piece of furniture must reach a target.

    The success condition is that the joint is within the tolerance of the target and moves slowly.

    The reward depends on the reward type:

    - ``dense``: 0.3 · nearness of the tool to the handle + 0.4 · fraction of the way to the target + 0.3 · nearness of
      the joint to the target + 0.5 if the success condition is met
    - ``sparse``: 0 if the success condition is met, otherwise −1

    Args:
        center: Center (x, y) of the square in which the handle is placed while the furniture is closed, in the world
            frame [m].
        area: Side length of the square in which the handle is placed [m].
        start_height: Height of the tool above the floor at the start of an episode [m].
        lowest: Minimum target position of the joint [m or rad].
        highest: Maximum target position of the joint [m or rad].
        tolerance: Maximum distance of the joint from its target at which the target is considered reached [m or rad].
        max_speed: Maximum speed at which the joint is considered slow [m/s or rad/s].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.manipulation.Manipulation`.

    Attributes:
        furniture: Name of the prop, which is also the name of its model file.
        unit: Unit of the joint position: ``"m"`` or ``"rad"``.

    Raises:
        ConfigurationError: A value is out of range.
    """

    reset_options: ClassVar[Sequence[str]] = ("target",)
    late_terms: ClassVar[Sequence[str]] = ("joint_position", "joint_velocity")
    finger_axis: ClassVar[str] = "x"
    furniture: ClassVar[str]
    unit: ClassVar[str]

    def __init__(
        self,
        *,
        center: Sequence[float] = (0.58, 0.0),
        area: float = 0.1,
        start_height: float = 0.3,
        lowest: float,
        highest: float,
        tolerance: float,
        max_speed: float,
        **keywords: Any,
    ) -> None:
        super().__init__(center=center, area=area, start_height=start_height, **keywords)
        self.lowest, self.highest = positive("lowest", lowest, self.unit), positive("highest", highest, self.unit)
        self.tolerance = positive("tolerance", tolerance, self.unit)
        self.max_speed = positive("max_speed", max_speed, f"{self.unit}/s")

    def scene(self) -> Scene:
        """Return a scene with the furniture on the floor."""
        x, y = self.center.tolist()
        model = f"frobs_tasks_manipulation:models/{self.furniture}.urdf.xacro"
        prop = Prop(model=model, pose=Pose((x + 0.1, y, 0.0)))
        return Scene(
            floor_friction=FLOOR_FRICTION, hard_contacts=True, props={self.furniture: prop}, cameras=self.cameras()
        )

    def cameras(self) -> dict[str, Camera]:
        """Return a camera that views the front of the furniture from the right."""
        x, y = self.center.tolist()
        return {"overview": Camera(pos=(x - 0.5, y - 0.85, 0.65), target=(x + 0.02, y, 0.13), fov_y=42.0)}

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for tool, handle (x, y), joint, handle − tool and target − joint."""
        return {
            **self.tool_terms(),
            "handle_position": bounded(lambda: self.handle[:, :2], 2, 2.0, "m", scale=4.0),
            "handle_direction": bounded(lambda: self.direction, 2, 1.0, "1"),
            "handle_offset": bounded(lambda: self.handle - self.tcp, 3, 2.0, "m", scale=5.0),
            "joint_position": bounded(lambda: self.joint[:, None], 1, 3.0, self.unit),
            "joint_velocity": bounded(lambda: self.joint_speed[:, None], 1, 10.0, f"{self.unit}/s"),
            "target_offset": bounded(lambda: (self.target - self.joint)[:, None], 1, 3.0, self.unit, scale=2.0),
        }

    def handle_at(self, joint: Floats) -> Floats:
        """Return the handle's positions (num_envs, 3) [m] in the world frame for joint positions (num_envs,)."""
        pos, _ = self._prop.model.frame_pose(HANDLE, joint[:, None])
        base_pos, base_quat = self._prop.base_pose  # pose of the furniture in this episode
        return base_pos + quat_rotate(base_quat, pos)

    def stored_arrays(self) -> Snapshot:
        """Return the target and the number of steps for which the success condition has been met."""
        return {**super().stored_arrays(), "target": self.target}

    def _bind_objects(self) -> None:
        self._prop = self._simulation.robots[self.furniture]
        self.target = np.full(self.num_envs, self.lowest)
        self._closed_handle = self._prop.model.frame_pose(HANDLE, np.zeros((1, 1)))[0]  # (1, 3) [m] from the base

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        place = self.draw_place("handle", rng, mask, height=0.0)
        turn = quat_from_axis_angle((0.0, 0.0, 1.0), rng.uniform("turn", -_TURN, _TURN, (), mask))
        pos = place - quat_rotate(turn, np.broadcast_to(self._closed_handle, place.shape)) * [1.0, 1.0, 0.0]
        self._prop.write_base_pose(pos, turn, mask)
        target = rng.uniform("target", self.lowest, self.highest, (1,), mask)  # (n, 1)
        if "target" in options:
            target = options["target"]
            if target.shape[1:] != (1,):
                raise ResetOptionError("target", f"has the shape {target.shape[1:]}; it must be (1,).")
            limit = self._prop.position_upper[0, 0]
            wrong = target[(target <= 0.0) | (target > limit)]
            if len(wrong):
                raise ResetOptionError("target", f"is {wrong[0]:g} {self.unit}; it must be in (0, {limit:g}].")
        self.target[rows_of(mask)] = target[:, 0]

    def _measure(self) -> None:
        super()._measure()
        self.handle, quat = self._prop.frame_pose(HANDLE)  # (num_envs, 3) [m]
        self.direction = matrix_from_quat(quat)[:, :2, 0]  # (num_envs, 2): horizontal part of the handle's x axis
        self.joint = self._prop.joint_positions[:, 0].copy()  # (num_envs,) [m or rad]
        self.joint_speed = self._prop.joint_velocities[:, 0].copy()  # (num_envs,) [m/s or rad/s]
        self.to_handle = length(self.handle - self.tcp)  # (num_envs,) [m]

    def _is_achieved(self) -> Mask:
        near = np.abs(self.joint - self.target) <= self.tolerance
        return np.asarray(near & (np.abs(self.joint_speed) <= self.max_speed))

    def _dense_terms(self) -> Mapping[str, Floats]:
        error = np.abs(self.target - self.joint)
        left = np.minimum(error / self.target, 1.0)
        return {
            "approach": 0.3 * nearness(self.to_handle, 0.2),
            "open": 0.4 - 0.4 * left,
            "stop": 0.3 * nearness(error, self.tolerance),
            "achieved": np.where(self._is_achieved(), 0.5, 0.0),
        }
