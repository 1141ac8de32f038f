"""Why a drawn fault survives, by module and what was changed: looked at one by one."""

from __future__ import annotations

from planting import Fault

_MEANING = "the contract leaves to the controller what an action means; it is held by"
REASONS: dict[tuple[str, str], str] = {
    (
        "frobs_controllers.tcp_delta_position",
        "line 38",
    ): "a parameter that is out of range is accepted; the kit gives none but those of the record",
    (
        "frobs_tasks_reach.goal",
        "line 90",
    ): "the reward's term has another name, and the same value; what terms are called is the task's own",
    (
        "frobs_controllers.joint_position",
        "line 59",
    ): "equivalent: every row of an array over the environments is the same there",
    (
        "frobs_controllers.differential_drive",
        "separation",
    ): f"it turns faster or slower than its action says; {_MEANING} `test_differential_drive.py`",
    (
        "frobs_tasks_reach.reach",
        "b * z - c * y",
    ): "what a column of the observation means is the task's own; `test_reach_terms.py` compares it with a rotation",
    (
        "frobs_tasks_reach.motion",
        "line 45",
    ): "the goals move along other paths of the same kind; how they move is the task's own, held by `test_reach_dynamic.py`",
    (
        "frobs_sim_mujoco.simulation",
        "distances > max_range",
    ): "equivalent: what is exactly at the range reads as the range either way",
    (
        "frobs_controllers.joint_delta_position",
        "self.reset(None)",
    ): "equivalent for the contract: environments reset a controller before they use it",
}
"""By module, and a part of the change."""


def reason(fault: Fault) -> str:
    """Return why a fault survives, or that nobody has looked at it yet."""
    for (module, change), text in REASONS.items():
        if module == fault.module and change in fault.where:
            return text
    return "not looked at yet"
