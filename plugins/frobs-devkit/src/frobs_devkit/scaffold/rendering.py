"""Renders the plugin templates in the same way as cookiecutter, without depending on cookiecutter."""

from __future__ import annotations

import json
import os
import runpy
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from frobs_cli.errors import MissingFileError, TargetExistsError
from frobs_devkit.scaffold.answers import QUESTIONS, asked, find_problem
from frobs_devkit.scaffold.clashes import check_clashes
from frobs_devkit.scaffold.errors import AnswerError
from frobs_devkit.scaffold.finish import finish, finish_robot, hidden_import


def template_folder() -> Path:
    """Return the folder that contains ``cookiecutter.json``.

    The folder is part of the wheel. For an editable install, it is in the repository.

    Raises:
        MissingFileError: Neither location contains ``cookiecutter.json``.
    """
    here = Path(__file__).parent
    for folder in (here / "files" / "cookiecutter", here.parents[4] / "cookiecutter"):
        if (folder / "cookiecutter.json").is_file():
            return folder
    raise MissingFileError(
        here / "files", "reinstall the plugin templates with 'pip install --force-reinstall frobs-devkit'"
    )


def resolve(given: Mapping[str, str]) -> dict[str, Any]:
    """Validate the answers, and return them with all default and derived values.

    Args:
        given: Answers by question.

    Raises:
        ConfigurationError: An answer is invalid, or its question does not exist or does not apply.
    """
    problem = find_problem(given)
    if problem:
        raise AnswerError(problem)
    for question in given:
        if question not in QUESTIONS:
            raise AnswerError(f"the question '{question}' does not exist; available questions: {', '.join(QUESTIONS)}.")
        if question not in asked(given) and given[question]:
            made = " with the example ".join(given[key] for key in ("what", "example") if key in given)
            raise AnswerError(f"{question} does not apply to a new {made}; omit it.")
    context = fill_in(given)
    problem = find_problem(context)
    if problem:
        raise AnswerError(problem)
    return context


def fill_in(given: Mapping[str, str]) -> dict[str, Any]:
    """Return the ``given`` answers with all default and derived values, without validating them."""
    context: dict[str, Any] = {}
    environment = _environment()
    for key, default in _description().items():
        if key.startswith("_") and not key.startswith("__"):
            context[key] = default
        elif key in given:
            context[key] = given[key]
        elif isinstance(default, list):
            context[key] = default[0]
        elif isinstance(default, str):
            context[key] = environment.from_string(default).render(cookiecutter=context)
    return context


def prompts() -> dict[str, Any]:
    """Return the text of each question.

    For a multiple-choice question, the text is a dictionary that contains a description of each choice, and the
    question itself under the key ``__prompt__``. For other questions, the text is a string.
    """
    questions: dict[str, Any] = _description()["__prompts__"]
    return questions


def render(context: Mapping[str, Any], output: Path) -> Path:
    """Write a plugin's files. If an error occurs, the plugin's folder is not created.

    Args:
        context: Result of :func:`resolve`.
        output: Folder in which to create the plugin's folder.

    Returns:
        The plugin's folder.

    Raises:
        ConfigurationError: The folder exists, a name is already in use, or the robot's model file is unsuitable.
        ModelFileError: The robot's model file cannot be read.
    """
    target: Path = output / context["__folder"]
    if target.exists() or target.is_symlink():
        raise TargetExistsError(target, "choose another name, or another folder with --output")
    check_clashes(context)
    if "robot" in context["__kinds"] and context["example"] == "file":
        from frobs_devkit.scaffold.robot_file import facts_for

        facts_for(context)  # raises errors before anything is written
    source = next(template_folder().glob("{{*}}"))
    environment = _environment()
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output, prefix=".frobs-new-") as folder:
        made = Path(folder) / context["__folder"]
        for file in sorted(path for path in source.rglob("*") if path.is_file() and "__pycache__" not in path.parts):
            name = environment.from_string(file.relative_to(source).as_posix()).render(cookiecutter=context)
            text = environment.from_string(file.read_text("utf-8")).render(cookiecutter=context)
            path = made / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, "utf-8", newline="\n")
            shutil.copymode(file, path)
        finish(made)
        if problem := hidden_import(made):
            raise AnswerError(problem)
        finish_robot(made, context)
        os.rename(made, target)
    return target


def _description() -> dict[str, Any]:
    content: dict[str, Any] = json.loads((template_folder() / "cookiecutter.json").read_text("utf-8"))
    return content


def _environment() -> Any:
    from jinja2 import Environment, StrictUndefined

    options = _description()["_jinja2_env_vars"]
    extension = runpy.run_path(str(template_folder() / "frobs_templates.py"))["Templates"]
    return Environment(undefined=StrictUndefined, keep_trailing_newline=True, extensions=[extension], **options)
