"""Cleans up after cookiecutter or ``frobs new`` has rendered the templates."""

import ast
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def finish(folder: Path) -> None:
    """Remove files that contain no text after rendering, and remove empty folders."""
    for path in sorted(folder.rglob("*"), reverse=True):
        if path.is_dir():
            if not any(path.iterdir()):
                path.rmdir()
        elif not path.read_text("utf-8").strip():
            path.unlink()


def hidden_import(folder: Path) -> str:
    """Return one line that names a class of the new plugin that hides an imported one, or ``""`` if there is none."""
    for path in sorted(folder.rglob("*.py")):
        body = ast.parse(path.read_text("utf-8")).body
        imported = {alias.name for node in body if isinstance(node, ast.ImportFrom) for alias in node.names}
        for node in body:
            if isinstance(node, ast.ClassDef) and node.name in imported:
                return f"the class '{node.name}' of the new plugin would hide an imported one; choose another name."
    return ""


def finish_robot(folder: Path, context: Mapping[str, Any]) -> None:
    """Copy a robot's model file, its license and all referenced files to the folder of the robot's description."""
    if context["example"] != "file" or "robot" not in context["__kinds"].split():
        return
    from frobs_devkit.scaffold.robot_file import copy_model, facts_for

    facts = facts_for(context)
    description = next(folder.rglob("src/*/robot.py"))
    copy_model(facts.model, description.with_name(facts.model_name))
    description.with_name("MODEL_LICENSE").write_text(facts.license, "utf-8")
