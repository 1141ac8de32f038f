"""Edits the plugin's ``task.py``: inserts the old timesteps, and comments about the remaining work."""

from __future__ import annotations

import re
from pathlib import Path

from frobs_rl_compat.migrate.comments import defines, insert_todo
from frobs_rl_compat.migrate.migration import COUNTERPARTS, Migration
from frobs_rl_compat.migrate.package import OldPackage

_ELSEWHERE = (*COUNTERPARTS["hooks"], "_send_action", "_check_subs_and_pubs_connection", "__init__")


def edit_task(package: OldPackage, file: Path, made: Migration) -> None:
    """Insert the old timesteps, and a comment for each old method to port, into a plugin's task file."""
    text = _with_timesteps(package, file.read_text("utf-8"), made)
    for hook, counterpart in COUNTERPARTS["hooks"].items():
        old = package.hook(hook)
        if old is None:
            made.leave(hook, "the package does not define this method")
            continue
        method = next(name for name in counterpart["methods"] if defines(text, name))
        text = insert_todo(text, method, f"{counterpart['advice'].format(name=old.place(hook))}.")
        made.leave(old.place(hook), f"port this method to {method} in task.py")
    for old in package.lineage:
        if "__init__" in old.methods:
            made.leave(old.place("__init__"), "move the setup code to the methods scene and bind in task.py")
    helpers = [old.place(name) for old in package.lineage for name in old.methods if name not in _ELSEWHERE]
    if helpers:
        made.leave("other methods", f"if the hooks call these methods, port them to task.py: {', '.join(helpers)}")
    file.write_text(text, "utf-8")


def _with_timesteps(package: OldPackage, text: str, made: Migration) -> str:
    """Return the text of the task file with the timesteps of the old environment, if actions had a fixed duration."""
    arguments = package.robot_arguments
    if arguments.get("step_mode", 1) != 2:
        made.leave("step_mode 1", "actions had no fixed duration; choose control_timestep in task.py")
        return text
    steps, step = arguments.get("num_gazebo_steps", 1), arguments.get("gazebo_timestep") or 0.001
    for name, value in (("control_timestep", round(step * steps, 9)), ("physics_timestep", step)):
        text = re.sub(rf"({name}: ClassVar\[float\] = )[0-9.]+", rf"\g<1>{value:g}", text)
    made.carry(f"{steps} steps of {step:g} s for each action", "task.py: control_timestep")
    return text
