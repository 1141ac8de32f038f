"""Why a fault survives, by module and what was changed: looked at one by one."""

from __future__ import annotations

from planting import Fault

_MEANING = "the contract leaves to the controller what an action means; it is held by"
NONE = "not looked at yet"
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
    (
        "by_strangers.algorithm.ppo_stores_clipped_actions",
        "",
    ): "the kit compares what a training does with its settings, and no setting states what the buffer holds; with the short trainings of the kit, the policy still learns",
    (
        "by_strangers.algorithm.sac_target_entropy_sign",
        "",
    ): "the weight of the entropy needs thousands of steps to grow; the kit trains for hundreds",
    (
        "by_strangers.controller.joint_velocity_brakes_within_a_physics_step",
        "",
    ): "that a joint is stopped before its limit is a promise of this controller alone; a velocity controller need not brake",
    ("by_strangers.controller.tcp_delta_pose_turns_about_tool_axes", ""): f"{_MEANING} `test_tcp_controllers.py`",
    ("by_strangers.controller.wheels_clipped_separately", ""): "with the robot's own limits no wheel is ever clipped",
    (
        "by_strangers.robot.arm_rods_about_their_ends",
        "",
    ): "inertias of four times the true value occur in sound files: an estimate from motions or a shell; the measured ones of the Panda exceed what its shapes allow",
    (
        "by_strangers.robot.inertia_about_link_frame",
        "",
    ): "inertias of four times the true value occur in sound files: an estimate from motions or a shell; the measured ones of the Panda exceed what its shapes allow",
    (
        "by_strangers.robot.lidar_mounted_upside_down",
        "",
    ): "lidars are mounted upside down on purpose, and their readings then run clockwise",
    (
        "by_strangers.simulator.paced_only_the_last_row",
        "",
    ): "in real time, the kit cannot tell the rows of one command apart from delays",
    ("by_strangers.task.goal_turned_the_wrong_way", ""): "what a column of the observation means is the task's own",
    ("by_strangers.task.navigate_progress_to_the_following_waypoint", ""): "what a reward means is the task's own",
    (
        "by_strangers.task.progress_always_zero",
        "",
    ): "a term may be 0 in all steps of random episodes, such as a bonus for success",
    ("by_strangers.task.push_held_in_total", ""): "when a condition counts as held is the task's own",
    ("by_strangers.task.unwrapped_bearing", ""): "an observation may jump, for example when the goal changes",
    (
        "by_strangers.algorithm.cross_entropy_mixes_episodes",
        "",
    ): "with the default of one episode per sample, nothing is mixed",
}
"""By module, and a part of the change."""


def reason(fault: Fault) -> str:
    """Return why a fault survives, or that nobody has looked at it yet."""
    for (module, change), text in REASONS.items():
        if module == fault.module and change in fault.where:
            return text
    return NONE
