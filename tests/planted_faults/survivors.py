"""Why a fault survives, by module and what was changed: looked at one by one."""

from __future__ import annotations

from planting import Fault

_MEANING = "the contract leaves to the controller what an action means; it is held by"
_INERTIA = (
    "sound files contain inertias of several times the true value, which come from motions or from shells; those of the "
    "Panda exceed what its shapes allow"
)
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

OF_STRANGERS = {
    "ppo_stores_clipped_actions": "no setting states what the buffer stores, and in short training runs the policy still learns",
    "sac_target_entropy_sign": "the weight of the entropy needs thousands of steps to grow, and the kit trains for hundreds",
    "cross_entropy_mixes_episodes": "with the default of one episode per sample, nothing is mixed",
    "joint_velocity_brakes_within_a_physics_step": "only this controller promises to stop a joint before its limit",
    "tcp_delta_pose_turns_about_tool_axes": f"{_MEANING} `test_tcp_controllers.py`",
    "wheels_clipped_separately": "with the robot's own limits, no wheel is ever clipped",
    "arm_rods_about_their_ends": _INERTIA,
    "inertia_about_link_frame": _INERTIA,
    "lidar_mounted_upside_down": "lidars may be mounted upside down on purpose, and their readings then run clockwise",
    "paced_only_the_last_row": "in real time, the kit cannot distinguish the rows of one command from delays",
    "goal_turned_the_wrong_way": "the task defines what an element of its observation means",
    "navigate_progress_to_the_following_waypoint": "the task defines its reward",
    "progress_always_zero": "a reward term may be 0 in all steps of random episodes, such as a bonus for success",
    "push_held_in_total": "the task defines when it has succeeded",
    "unwrapped_bearing": "an observation may jump, for example when the goal changes",
}
"""Why the kit misses a fault in ``by_strangers``, by the name of its file."""


def reason(fault: Fault) -> str:
    """Return why a fault survives, or that nobody has looked at it yet."""
    if fault.where in OF_STRANGERS:
        return OF_STRANGERS[fault.where]
    for (module, change), text in REASONS.items():
        if module == fault.module and change in fault.where:
            return text
    return "not looked at yet"
