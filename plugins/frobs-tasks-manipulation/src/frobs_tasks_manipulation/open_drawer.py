"""Task of opening a drawer by its handle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from frobs_tasks_manipulation.open_task import OpenTask


class OpenDrawer(OpenTask):
    """Task of opening a drawer by its handle to a target distance.

    For the success condition, the reward and further parameters, see
    :class:`~frobs_tasks_manipulation.open_task.OpenTask`.

    Args:
        lowest: Minimum target distance [m].
        highest: Maximum target distance [m].
        tolerance: Maximum position error at which the target is considered reached [m].
        max_speed: Maximum speed at which the drawer is considered slow [m/s].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.open_task.OpenTask`.
    """

    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.open:PullHandle"
    success_rule: ClassVar[str] = (
        "during the last hold_steps control steps before the time limit, "
        "the drawer is at the target distance and moves slowly"
    )
    instruction: ClassVar[str] = "Open the drawer by its handle to the target distance."
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.3 · (1 − tanh(d / 0.2 m)), where d is the distance from the tool to the handle",
        "open": "0.4 · max(1 − |target − q| / target, 0), where q is the opening of the drawer [m]",
        "stop": "0.3 · (1 − tanh(|target − q| / tolerance))",
        "achieved": "0.5 if the drawer is at the target distance and moves slowly",
        "unachieved": "−1 unless the drawer is at the target distance and moves slowly",
    }
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
