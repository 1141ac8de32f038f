"""Open a door by its handle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from frobs_tasks_manipulation.open_task import OpenTask


class OpenDoor(OpenTask):
    """Open a door by its handle, to a target.

    The condition of success, the reward and the parameters are those of
    :class:`~frobs_tasks_manipulation.open_task.OpenTask`.

    Args:
        lowest: Smallest target [rad].
        highest: Largest target [rad].
        tolerance: Distance from the target that counts as reached [rad].
        max_speed: Speed below which the door counts as slow [rad/s].
        keywords: Those of :class:`~frobs_tasks_manipulation.open_task.OpenTask`.
    """

    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.open:PullHandle"
    success_rule: ClassVar[str] = (
        "the door has been open as far as the target, and slow, for the last hold_steps when the time limit ends the episode"
    )
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.3 · (1 − tanh(d / 0.2 m)), d being the distance from tool to handle",
        "open": "0.4 · max(1 − |target − q| / target, 0), q being the angle of the door [rad]",
        "stop": "0.3 · (1 − tanh(|target − q| / tolerance))",
        "achieved": "0.5 where the door is at the target and slow",
        "unachieved": "−1 where it is not",
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
