"""Why a drawn fault survives, by module and what was changed: looked at one by one."""

from __future__ import annotations

from planting import Fault

_MEANING = "the contract leaves to the controller what an action means; it is held by"
REASONS: dict[tuple[str, str], str] = {
    (
        "frobs_controllers.joint_delta_position",
        "np.add",
    ): f"only with `full_range=True`, which the kit is not given; {_MEANING} `test_joint_controllers.py`",
    (
        "frobs_controllers.joint_delta_position",
        "/ 2",
    ): f"only with `full_range=True`, which the kit is not given; {_MEANING} `test_joint_controllers.py`",
    (
        "frobs_controllers.joint_position",
        "np.subtract",
    ): f"it goes elsewhere, inside the limits, and rests there; {_MEANING} `test_joint_controllers.py`",
    (
        "frobs_controllers.joint_velocity",
        "control_timestep",
    ): f"it slows down too early near a limit, and stays inside; {_MEANING} `test_joint_controllers.py`",
    (
        "frobs_controllers.differential_drive",
        "1.0",
    ): f"it drives twice as fast as its action says; {_MEANING} `test_differential_drive.py`",
    (
        "frobs_tasks_reach.reach",
        "1.01",
    ): "equivalent for the contract: the bounds of the observation space, which need only be wide enough, get wider",
    (
        "frobs_tasks_reach.reach",
        "high - goal_low",
    ): "equivalent for the contract: the bounds of the observation space stay wide enough for what is observed",
    (
        "frobs_tasks_reach.terms",
        "p * y - q * x",
    ): "what a column of the observation means is the task's own; `test_reach_terms.py` compares it with a rotation",
}
"""By module, and a part of the change."""


def reason(fault: Fault) -> str:
    """Return why a fault survives, or that nobody has looked at it yet."""
    for (module, change), text in REASONS.items():
        if module == fault.module and change in fault.where:
            return text
    return "not looked at yet"
