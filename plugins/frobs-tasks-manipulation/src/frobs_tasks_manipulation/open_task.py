"""Tasks in which a piece of furniture must be opened by its handle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Snapshot
from frobs_core.description import Camera, ObservationTerm, Prop, Rewards, RewardTerm, Scene
from frobs_core.models import Pose
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ResetOptionError
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import matrix_from_quat, quat_rotate
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.manipulation import FLOOR_FRICTION, Manipulation
from frobs_tasks_manipulation.rewards import HELD, length, nearness, shaped
from frobs_tasks_manipulation.tracked import bounded
from frobs_tasks_manipulation.working_area import draw_turn

HANDLE = "handle"
_TURN = 0.15
"""Maximum initial rotation of the furniture about the vertical axis [rad]."""

_DOOR = "the door is at the target angle and moves slowly"
_DRAWER = "the drawer is at the target distance and moves slowly"


def _rewards(condition: str, joint: str) -> Rewards:
    """Return the rewards for furniture whose joint position is described by ``joint``."""
    return shaped(
        condition,
        approach=RewardTerm(
            function=lambda task: nearness(task.to_handle, 0.2),
            weight=0.3,
            meaning="1 − tanh(d / 0.2 m), where d is the distance from the tool to the handle",
        ),
        open=RewardTerm(
            function=lambda task: 1.0 - np.minimum(task.error / task.target, 1.0),
            weight=0.4,
            meaning=f"max(1 − |target − q| / target, 0), where q is {joint}",
        ),
        stop=RewardTerm(
            function=lambda task: nearness(task.error, task.tolerance),
            weight=0.3,
            meaning="1 − tanh(|target − q| / tolerance)",
        ),
    )


class OpenTask(Manipulation):
    """Base class of tasks in which the joint of a piece of furniture must reach a target.

    The success condition is that the joint is within the tolerance of the target and moves slowly.

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
        error: Distance of the joint from its target, (num_envs,) [m or rad].
        to_handle: Distance from the tool to the handle, (num_envs,) [m].

    Raises:
        ConfigurationError: A value is out of range.
    """

    reset_options: ClassVar[Sequence[str]] = ("target",)
    late_terms: ClassVar[Sequence[str]] = ("joint_position", "joint_velocity")
    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.open:PullHandle"
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
        props = {self.furniture: Prop(model=model, pose=Pose((x + 0.1, y, 0.0)))}
        return Scene(floor_friction=FLOOR_FRICTION, hard_contacts=True, props=props, cameras=self.cameras())

    def cameras(self) -> dict[str, Camera]:
        """Return a camera that shows the whole arm, and one that views the front of the furniture from the right."""
        x, y = self.center.tolist()
        overview = Camera(pos=(x - 0.5, y - 0.85, 0.65), target=(x + 0.02, y, 0.13), fov_y=42.0)
        return {"whole": self.working_area.whole_view(), "overview": overview}

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for tool, handle (x, y), joint, handle − tool and target − joint."""
        return {
            **self.tool.terms(),
            "handle_position": bounded(self.handle[:, :2], 2.0, "m", scale=4.0),
            "handle_direction": bounded(self.direction, 1.0, "1"),
            "handle_offset": bounded(self._handle_offset, 2.0, "m", scale=5.0),
            "joint_position": bounded(self.joint[:, None], 3.0, self.unit),
            "joint_velocity": bounded(self.joint_speed[:, None], 10.0, f"{self.unit}/s"),
            "target_offset": bounded(self._target_offset[:, None], 3.0, self.unit, scale=2.0),
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
        self._closed_handle = self._prop.model.frame_pose(HANDLE, np.zeros((1, 1)))[0]  # (1, 3) [m] from the base
        self.handle, self._handle_offset = np.zeros((2, self.num_envs, 3))  # [m]
        self.direction = np.zeros((self.num_envs, 2))  # horizontal part of the handle's x axis
        self.joint, self.joint_speed, self._target_offset = np.zeros((3, self.num_envs))
        self.target = np.full(self.num_envs, self.lowest)

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        place = self.working_area.draw("handle", rng, mask, height=0.0)
        turn = draw_turn("turn", rng, mask, _TURN)
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
        self.handle[:], quat = self._prop.frame_pose(HANDLE)
        self.direction[:] = matrix_from_quat(quat)[:, :2, 0]
        self.joint[:] = self._prop.joint_positions[:, 0]  # [m or rad]
        self.joint_speed[:] = self._prop.joint_velocities[:, 0]  # [m/s or rad/s]
        self._handle_offset[:] = self.handle - self.tool.pos
        self._target_offset[:] = self.target - self.joint
        self.to_handle, self.error = length(self._handle_offset), np.abs(self._target_offset)

    def _is_achieved(self) -> Mask:
        return np.asarray((self.error <= self.tolerance) & (np.abs(self.joint_speed) <= self.max_speed))


class OpenDoor(OpenTask):
    """Task of opening a door by its handle to a target angle.

    For the success condition and further parameters, see :class:`~frobs_tasks_manipulation.open_task.OpenTask`.

    The reward depends on the reward type:

    {rewards}

    Args:
        lowest: Minimum target angle [rad].
        highest: Maximum target angle [rad].
        tolerance: Maximum angle error at which the target is considered reached [rad].
        max_speed: Maximum speed at which the door is considered slow [rad/s].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.open_task.OpenTask`.
    """

    success_rule: ClassVar[str] = HELD + _DOOR
    instruction: ClassVar[str] = "Open the door by its handle to the target angle."
    rewards: ClassVar[Rewards] = _rewards(_DOOR, "the angle of the door [rad]")
    furniture: ClassVar[str] = "door"
    unit: ClassVar[str] = "rad"

    def __init__(
        self,
        *,
        lowest: float = 0.6,
        highest: float = 1.0,
        tolerance: float = 0.1,
        max_speed: float = 0.2,
        **keywords: Any,
    ) -> None:
        super().__init__(lowest=lowest, highest=highest, tolerance=tolerance, max_speed=max_speed, **keywords)


class OpenDrawer(OpenTask):
    """Task of opening a drawer by its handle to a target distance.

    For the success condition and further parameters, see :class:`~frobs_tasks_manipulation.open_task.OpenTask`.

    The reward depends on the reward type:

    {rewards}

    Args:
        lowest: Minimum target distance [m].
        highest: Maximum target distance [m].
        tolerance: Maximum position error at which the target is considered reached [m].
        max_speed: Maximum speed at which the drawer is considered slow [m/s].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.open_task.OpenTask`.
    """

    success_rule: ClassVar[str] = HELD + _DRAWER
    instruction: ClassVar[str] = "Open the drawer by its handle to the target distance."
    rewards: ClassVar[Rewards] = _rewards(_DRAWER, "the opening of the drawer [m]")
    furniture: ClassVar[str] = "drawer"
    unit: ClassVar[str] = "m"

    def __init__(
        self,
        *,
        lowest: float = 0.08,
        highest: float = 0.16,
        tolerance: float = 0.02,
        max_speed: float = 0.05,
        **keywords: Any,
    ) -> None:
        super().__init__(lowest=lowest, highest=highest, tolerance=tolerance, max_speed=max_speed, **keywords)
