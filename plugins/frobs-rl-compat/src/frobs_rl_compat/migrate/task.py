"""Edits the plugin's ``task.py``: inserts the old task's parameters, and comments about the remaining work."""

from __future__ import annotations

import re
from pathlib import Path

from frobs_rl_compat.migrate.comments import has_method, insert_in_method, todo
from frobs_rl_compat.migrate.migration import Migration
from frobs_rl_compat.migrate.package import OldPackage

HOOKS = {
    "_get_observation": (
        ("observation_terms",),
        "return the same values as {name}, as observation terms with one row for each environment",
    ),
    "_get_reward": (
        ("reward",),
        "return the same rewards as {name}, one for each environment; store each term in self._terms",
    ),
    "_check_if_done": (
        ("is_terminated", "is_success"),
        "return a mask of the environments in which {name} returns True; in is_success, return a mask of those in "
        "which "
        "{name} sets info['is_success']",
    ),
    "_set_episode_init_params": (("reset",), "start episodes as {name} does, but draw random numbers from rng"),
}
"""For each of FRobs_RL's hooks: the task methods that can replace the hook, in order of preference, and a comment."""

_ELSEWHERE = (*HOOKS, "_send_action", "_check_subs_and_pubs_connection", "__init__")


def edit_task(package: OldPackage, file: Path, made: Migration) -> None:
    """Insert the known parameters, and a comment for each old method to port, into a plugin's task file."""
    text = _with_numbers(package, file.read_text("utf-8"), made)
    for hook, (methods, advice) in HOOKS.items():
        old = package.hook(hook)
        if old is None:
            made.leave(hook, "the package does not define this method")
            continue
        method = next(name for name in methods if has_method(text, name))
        text = insert_in_method(text, method, todo(f"{advice.format(name=old.place(hook))}.", 8))
        made.leave(old.place(hook), f"port this method to {method} in task.py")
    for old in package.lineage:
        if "__init__" in old.methods:
            made.leave(old.place("__init__"), "move the setup code to the methods scene and bind in task.py")
    pose = {key: value for key, value in package.constructed.parameters.items() if key.startswith("model_") and value}
    pose.pop("model_name_in_gazebo", None)
    pose.pop("model_ori_w", None)
    if pose and has_method(text, "scene"):
        shown = ", ".join(f"{key}={value}" for key, value in pose.items())
        text = insert_in_method(text, "scene", todo(f"Pass robot_pose=… to Scene: the old robot was at {shown}.", 8))
        made.leave("the robot's pose in the world frame", f"in task.py, pass robot_pose=… to Scene with {shown}")
    helpers = [old.place(name) for old in package.lineage for name in old.methods if name not in _ELSEWHERE]
    if helpers:
        made.leave("other methods", f"if the hooks call these methods, port them to task.py: {', '.join(helpers)}")
    file.write_text(text, "utf-8")


def _with_numbers(package: OldPackage, text: str, made: Migration) -> str:
    """Return the text of the task file with known parameters inserted."""
    given = package.constructed.parameters
    step = given.get("gazebo_timestep") or 0.001
    if given.get("step_mode", 1) == 2:
        control = round(step * int(given.get("num_gazebo_steps") or 1), 9)
        for name, value in (("control_timestep", control), ("physics_timestep", step)):
            text = re.sub(rf"({name}: ClassVar\[float\] = )[0-9.]+", rf"\g<1>{value:g}", text)
        made.carry(
            f"{given.get('num_gazebo_steps', 1)} steps of {step:g} s for each action", "task.py: control_timestep"
        )
    else:
        made.leave("step_mode 1", "actions had no fixed duration; choose control_timestep in task.py")
    try:
        tolerance = float(package.yaml.parameter(_first_key(package, "tolerance_goal_pos")))
    except (KeyError, TypeError, ValueError):
        return text
    if "goal_distance" not in text and tolerance > 0.0:
        text = re.sub(r"(tolerance: float = )[0-9.]+", rf"\g<1>{tolerance:g}", text)
        made.carry("tolerance_goal_pos", f"task.py: tolerance = {tolerance:g}")
    return text


def _first_key(package: OldPackage, name: str) -> str:
    """Return a parameter's name, prefixed by the first root key that contains the parameter."""
    for mapping in package.yaml.numbers.values():
        for root, section in mapping.items():
            if isinstance(section, dict) and name in section:
                return f"{root}/{name}"
    return name
