"""Determines the parameters that make one of FRobs's tasks equivalent to a recognized package's task."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import Any

from frobs_core.util.errors import FrobsError
from frobs_rl_compat.migrate.package import OldPackage
from frobs_rl_compat.migrate.recognition import factors, recognize
from frobs_rl_compat.migrate.robot import RobotSource
from frobs_rl_compat.migrate.values import UntranslatableError, bounds_of, value_of
from frobs_rl_compat.migrate.world import STEP, check_world_is_empty, read_floor_plan

NEAREST_IDS = {
    "maze": "frobs/KobukiMazeLegacy-v0",
    "dynamic": "frobs/KobukiDynamicLegacy-v0",
    "empty": "frobs/KobukiEmptyLegacy-v0",
    "reach_velocity": "frobs/Irb140ReachVelocityLegacy-v0",
}
"""For each example task, the ID of the FRobs environment that uses the original parameters."""

_NAVIGATION = {
    "tolerance_goal_pos": "self.tol_goal_pos",
    "step_reward": "self.step_reward",
    "multiplier_dist_reward": "self.mult_dist_reward",
    "reached_goal_reward": "self.reached_goal_reward",
}
_COLLISION = {"collision_reward": "self.collision_reward", "collision_distance_threshold": "self.collision_distance"}
_MAZE = {
    "angle_diff_reward_multiplier": "self.angle_diff_reward_multiplier",
    "reached_midway_reward": "self.reached_midway_reward",
    "not_reached_midway_reward": "self.not_reached_midway_reward",
}
_REACH = {
    "min_joint_pos": "self.min_joint_values",
    "max_joint_pos": "self.max_joint_values",
    "position_goal_min": "self.position_goal_min",
    "position_goal_max": "self.position_goal_max",
    "tolerance_goal_pos": "self.tol_goal_ee",
    "training": "self.training",
    "pos_dynamic": "self.pos_dynamic",
    "multiplier_dist_reward": "self.mult_dist_reward",
    "reached_goal_reward": "self.reached_goal_reward",
    "joint_limits_reward": "self.joint_limits_reward",
}
"""For each parameter of FRobs's tasks, the attribute of the original class that contains its value."""


@dataclass
class Example:
    """One of FRobs's tasks with a package's parameters.

    Attributes:
        task: Name of the task, such as ``"navigate_legacy"``.
        controller: Name of the controller that executes the package's actions.
        parameters: Keyword arguments of the environment.
        floor_plan: Floor plan for ``frobs-tasks-navigation`` with walls, boxes, starts and goals. It is empty for arms.
        differences: Aspects in which FRobs's task differs from the package's task, each with the behavior of FRobs's
            task.
    """

    task: str
    controller: str
    parameters: dict[str, Any]
    floor_plan: dict[str, Any] = field(default_factory=dict)
    differences: dict[str, str] = field(default_factory=dict)


def find_example(package: OldPackage, robot: RobotSource | None) -> tuple[Example | None, str]:
    """Return FRobs's task that is equivalent to a package's task.

    Args:
        package: The package.
        robot: The package's robot, or None if the robot's file could not be used.

    Returns:
        The task and an empty string, or None and the reason why the package cannot be translated.
    """
    known = recognize(package)
    if known is None:
        if any("moveit" in ast.unparse(old.node).lower() for old in package.lineage):
            return (
                None,
                "the package uses MoveIt, which cannot be translated; port the task as described in the rows below",
            )
        return None, "arbitrary code cannot be translated; port the task as described in the rows below"
    original = f"the task is the FRobs_RL example that {NEAREST_IDS[known.name]} reproduces"
    if known.differing:
        return (
            None,
            f"{original}, except for {'; '.join(known.differing)}. Port the changes, or start from that environment",
        )
    if robot is None:
        return None, f"{original}, but the robot's file could not be used"
    try:
        if package.constructed.parameters.get("step_mode", 1) != 1:
            raise UntranslatableError("step_mode is not 1")
        check_world_is_empty(package)
        return _reach(package, robot) if known.name == "reach_velocity" else _navigation(known.name, package, robot), ""
    except (FrobsError, UntranslatableError) as error:
        return None, f"{original}, but {error}"


def _reach(package: OldPackage, robot: RobotSource) -> Example:
    speeds = value_of(package, "self.limit_joint_vel")
    if len(set(speeds)) != 1:
        raise UntranslatableError("limit_joint_vel differs between the joints")
    margins = set(factors(package.lineage[0].methods["_get_reward"]))
    if len(margins) != 1:
        raise UntranslatableError("the margins at the lower and the upper joint limits differ")
    if "ee_link" not in [link.name for link in robot.model.links]:
        raise UntranslatableError("the robot has no link 'ee_link', which the task observes")
    task = {key: value_of(package, name) for key, name in _REACH.items()}
    if task["pos_dynamic"]:
        names = [f"{axis}_max_{what}" for what in ("amplitude", "freq") for axis in "xyz"]
        task["pos_dynamic_params"] = {key: _goal_parameter(package, key) for key in names}
    return Example(
        "reach_legacy_velocity",
        "joint_velocity",
        {
            "tcp": "ee_link",
            "controller_kwargs": {"max_velocity": speeds[0]},
            "limit_margin": margins.pop(),
            "limits": "configured",
            "goals": "box",
            "initial": "random",
            **task,
        },
        differences={
            "duration of a step": "0.1 s (previously not fixed); to change it, set control_timestep in PARAMETERS",
            "actions at a limit": "joints stop exactly at the limit; FRobs_RL ignored actions near the limit",
            "initial joint positions": "only positions in which no part of the robot is below the floor",
            "direction to the goal at distance zero": "zero (previously NaN)",
        },
    )


def _goal_parameter(package: OldPackage, key: str) -> float:
    """Return a parameter of the ROS node that moves the goal."""
    try:
        return float(package.yaml.parameter(f"irb140/pos_dynamic_params/{key}"))
    except (KeyError, TypeError, ValueError) as error:
        raise UntranslatableError(f"no YAML file contains the parameter irb140/pos_dynamic_params/{key}") from error


def _navigation(name: str, package: OldPackage, robot: RobotSource) -> Example:
    if robot.wheels is None:
        raise UntranslatableError("the robot's file does not contain a differential-drive plugin")
    low, high = bounds_of(package, "self.action_space")
    if low != [-value for value in high]:
        raise UntranslatableError(f"action_space is not symmetric: {low} to {high}")
    task = {key: value_of(package, attribute) for key, attribute in _NAVIGATION.items()}
    differences = {
        "duration of a step": f"{STEP:g} s (previously not fixed); boxes move the same distance per step as before",
        "observation_space": "the observed values are the same, but their bounds are derived from floor_plan.yaml",
    }
    if name == "maze":
        task |= {key: value_of(package, attribute) for key, attribute in _MAZE.items()}
        differences["distance and bearing in the step after a waypoint is reached"] = (
            "relative to the next waypoint (previously relative to the waypoint that was reached)"
        )
    else:
        differences["goals"] = (
            "at least 0.5 m from boxes and the start; to change the distance, set clearance in floor_plan.yaml"
        )
    if name == "dynamic":
        task["angle_diff_reward_multiplier"] = next(iter(factors(package.lineage[0].methods["_get_reward"])), 0.0)
    sensors = {"bumper": {"type": "bumper", "frame": robot.base_link}}
    if name != "empty":
        lidar = robot.lidar_topics.get("scan")
        if lidar is None:
            raise UntranslatableError(
                f"the robot's file does not contain a lidar with the topic /scan. {robot.lidar_problem}".strip()
            )
        rays, declared = robot.lidars[lidar].rays, value_of(package, "self.lidar_samples")
        if rays != declared:
            differences["lidar_samples"] = (
                f"{rays}, the number of rays of the robot's lidar; the YAML file contained {declared}, so the "
                "observation did not match observation_space"
            )
        task |= {"lidar": lidar, "lidar_samples": rays}
        task |= {key: value_of(package, attribute) for key, attribute in _COLLISION.items()}
    speeds = {"max_linear_velocity": high[0], "max_angular_velocity": high[1]}
    return Example(
        "navigate_legacy",
        "differential_drive",
        {"world": name, "controller_kwargs": speeds, "sensors": sensors, **task},
        read_floor_plan(name, package),
        differences,
    )
