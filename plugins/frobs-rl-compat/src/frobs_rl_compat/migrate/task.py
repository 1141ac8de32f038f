"""``task.py`` of the plugin: the old hooks as comments where their work is done now, and what numbers have a place."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from frobs_rl_compat.migrate.comments import commented, has_method, insert_in_method
from frobs_rl_compat.migrate.constructor import PARAMETERS
from frobs_rl_compat.migrate.package import OldPackage
from frobs_rl_compat.migrate.report import Migration

HOOKS = {
    "_get_observation": (
        ("observation_terms",),
        "return terms that read what {name} returned, a row for each environment",
    ),
    "_get_reward": (("reward",), "return what {name} did, a row for each environment; each term into self._terms"),
    "_check_if_done": (
        ("is_terminated", "is_success"),
        "return where {name} was true, and in is_success where it set info['is_success']",
    ),
    "_set_episode_init_params": (("reset",), "begin episodes as {name} did, with random numbers from rng"),
}
"""FRobs_RL's hooks: the methods of a task that may do their work now, the first that there is, and what is to do."""

_CONSTRUCTOR = "__init__"
_ELSEWHERE = (*HOOKS, "_send_action", "_check_subs_and_pubs_connection", _CONSTRUCTOR)


def edit_task(package: OldPackage, file: Path, made: Migration) -> None:
    """Edit the task of a plugin."""
    text = _with_numbers(package, file.read_text("utf-8"), made)
    for hook, (methods, todo) in HOOKS.items():
        found = package.hook(hook)
        if found is None:
            made.leave(hook, "the package does not have it")
            continue
        old, lines = found
        method = next(name for name in methods if has_method(text, name))
        text = insert_in_method(text, method, commented(lines, 8, todo.format(name=f"{old.name}.{hook}") + "."))
        made.carry(hook, f"task.py: a comment in {method}")
    for old in reversed(package.lineage):
        lines = old.text(_CONSTRUCTOR, _said_elsewhere) if _CONSTRUCTOR in old.methods else []
        if lines:
            todo = f"what {old.name} prepared; original.OBSERVATION_SPACE has the bounds of its observation."
            text = insert_in_method(text, "bind", commented(lines, 8, todo))
            made.carry(f"{old.name}.__init__", "task.py: a comment in bind")
    pose = {key: value for key, value in package.constructed.parameters.items() if key.startswith("model_") and value}
    pose.pop("model_name_in_gazebo", None)
    pose.pop("model_ori_w", None)
    if pose and has_method(text, "scene"):
        shown = ", ".join(f"{key}={value}" for key, value in pose.items())
        text = insert_in_method(text, "scene", commented([], 8, f"Scene(robot_pose=…): the robot stood at {shown}."))
        made.carry("the robot's place in the world", "task.py: a comment in scene")
    file.write_text(text + _helpers(package, made), "utf-8")


def _said_elsewhere(statement: ast.stmt) -> bool:
    """Return whether a statement of a constructor is in ``original.py``, or is only said to people."""
    if isinstance(statement, ast.Assign):
        return all(ast.unparse(target).removeprefix("self.") in PARAMETERS for target in statement.targets)
    if not isinstance(statement, ast.Expr):
        return False
    called = ast.unparse(statement.value.func) if isinstance(statement.value, ast.Call) else ""
    return isinstance(statement.value, ast.Constant) or called.endswith(".__init__") or called.startswith("rospy.log")


def _with_numbers(package: OldPackage, text: str, made: Migration) -> str:
    """Return the task with the numbers that it has a place for."""
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
        made.leave("step_mode 1", "an action had no fixed duration; choose control_timestep in task.py")
    try:
        tolerance = float(package.yaml.parameter(_first_key(package, "tolerance_goal_pos")))
    except (KeyError, TypeError, ValueError):
        return text
    if "goal_distance" not in text and tolerance > 0.0:
        text = re.sub(r"(tolerance: float = )[0-9.]+", rf"\g<1>{tolerance:g}", text)
        made.carry("tolerance_goal_pos", f"task.py: tolerance = {tolerance:g}")
    return text


def _first_key(package: OldPackage, name: str) -> str:
    """Return the parameter of a name under the first root key that has it."""
    for mapping in package.yaml.numbers.values():
        for root, section in mapping.items():
            if isinstance(section, dict) and name in section:
                return f"{root}/{name}"
    return name


def _helpers(package: OldPackage, made: Migration) -> str:
    """Return the other methods of the old classes, as comments for the end of the file."""
    parts: list[str] = []
    for old in package.lineage:
        for method in old.methods:
            if method in _ELSEWHERE:
                continue
            lines = [old.signature(method), *(f"    {line}" if line else "" for line in old.text(method))]
            parts += ["", *commented(lines, 0, f"{old.name}.{method}, if something above still wants it.")]
            made.carry(f"{old.name}.{method}", "task.py: a comment at the end")
    return "\n".join(["", *parts, ""]) if parts else ""
