"""Task of opening a door by its handle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from frobs_tasks_manipulation.open_task import OpenTask


class OpenDoor(OpenTask):
    """Task of opening a door by its handle to a target angle.

    For the success condition, the reward and further parameters, see
    :class:`~frobs_tasks_manipulation.open_task.OpenTask`.

    Args:
        lowest: Minimum target angle [rad].
        highest: Maximum target angle [rad].
        tolerance: Maximum angle error at which the target is considered reached [rad].
        max_speed: Maximum speed at which the door is considered slow [rad/s].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.open_task.OpenTask`.
    """

    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.open:PullHandle"
    success_rule: ClassVar[str] = (
        "during the last hold_steps control steps before the time limit, "
        "the door is at the target angle and moves slowly"
    )
    instruction: ClassVar[str] = "Open the door by its handle to the target angle."
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.3 · (1 − tanh(d / 0.2 m)), where d is the distance from the tool to the handle",
        "open": "0.4 · max(1 − |target − q| / target, 0), where q is the angle of the door [rad]",
        "stop": "0.3 · (1 − tanh(|target − q| / tolerance))",
        "achieved": "0.5 if the door is at the target angle and moves slowly",
        "unachieved": "−1 unless the door is at the target angle and moves slowly",
    }
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
