"""``frobs new``: creates a plugin from templates."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from frobs_cli.facts import print_facts
from frobs_cli.field_options import option
from frobs_cli.model_options import PackagePath, XacroArgs
from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note, print_title
from frobs_core.util.errors import MissingSettingError
from frobs_devkit.scaffold.answers import CHOICES, QUESTIONS, asked, find_problem

_SHIPPED = "frobs/Irb120Reach-v0"  # an ID with a trained policy


@dataclass(frozen=True, kw_only=True)
class NewOptions:
    """Options of ``frobs new``: answers to questions, and the folder for the plugin.

    Attributes:
        example: Example to start from: arm (reaches for a goal), wheeled (drives to a goal) or file (your own arm).
        paced: Create a simulator whose world advances on its own, such as an interface to a real robot.
        robot_file: Model file of your arm: URDF, xacro or MJCF.
        tcp: Link of your arm that serves as the tool center point (TCP).
        failing_checks: What to do if --robot-file fails conformance checks: reject the file, or expect these failures
            in the plugin's tests.
        robot: Installed robot that performs the new task. Requires WHAT to be task.
        namespace: Namespace of the Gymnasium IDs (the part before the slash).
        author: Copyright holder.
        license: License of the plugin.
        ci: CI service that runs the tests on each push.
        output: Folder in which to create the plugin's folder.
    """

    example: str | None = option(None, show_default="arm; file if --robot-file is given")
    paced: bool = option(False)
    robot_file: Path | None = option(None)
    tcp: str | None = option(None, metavar="LINK", show_default="the most likely link")
    args: XacroArgs = None
    package_path: PackagePath = None
    failing_checks: str | None = option(None, metavar="|".join(CHOICES["failing_checks"]), show_default="reject")
    robot: str | None = option(None, show_default="irb120")
    namespace: str | None = option(None, show_default="lab")
    author: str | None = option(None, show_default="Your Name")
    license: str | None = option(None, metavar="|".join(CHOICES["license"]), show_default="MIT")
    ci: str | None = option(None, metavar="|".join(CHOICES["ci"]), show_default="github")
    output: Path = option(Path(), metavar="DIR", show_default="the current folder")

    def answers(self) -> dict[str, str]:
        """Return the answers by question, without questions that were not answered."""
        file, example = self.robot_file, self.example
        answers = {question: getattr(self, question) for question in QUESTIONS if hasattr(self, question)}
        answers |= {
            "example": "file" if file is not None and example is None else example,
            "paced": "yes" if self.paced else None,
            "robot_file": None if file is None else str(file.expanduser().absolute()),
            "xacro_args": " ".join(self.args) if self.args else None,
            "package_paths": os.pathsep.join(self.package_path) if self.package_path else None,
        }
        return {question: answer for question, answer in answers.items() if answer is not None}


def new(
    options: NewOptions,
    what: Annotated[
        str | None,
        typer.Argument(metavar="WHAT", show_default=False, help=f"What to create: {', '.join(CHOICES['what'])}."),
    ] = None,
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME", show_default=False, help="Name by which users refer to the new part, such as my_arm."
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Create a plugin from templates. You can install it, test it and use it for training without edits.

    In a terminal, the command asks for missing answers unless both WHAT and NAME are given. The type 'pair' creates a
    robot and a task for it as two distributions, and 'both' creates the robot and the task as one distribution.

    Example:
        $ frobs new
        $ frobs new pair my_arm
        $ frobs new both my_rover --example wheeled --namespace acme
        $ frobs new simulator my_robot --paced
        $ frobs new pair xarm6 --robot-file xarm6.urdf --tcp link6
    """
    from frobs_devkit.scaffold import render, resolve

    arguments = {"what": what, "name": name}
    given = {question: answer for question, answer in arguments.items() if answer is not None} | options.answers()
    if not {"what", "name"} <= given.keys():
        if json or not sys.stdin.isatty():
            raise MissingSettingError(
                "frobs new",
                "the type and name of the new part",
                f"for example 'frobs new pair my_arm'; types: {', '.join(CHOICES['what'])}",
            )
        given = _ask(given)
    with only_json(json):
        context = resolve(given)
        folder = render(context, options.output)
    facts = _facts(context, folder)
    if json:
        print_json(facts)
    else:
        print_facts({key: value for key, value in facts.items() if key not in ("files", "answers", "next")})
        print_line()
        print_title("  next")
        for command in facts["next"]:
            print_line(f"    {command}")


def _facts(context: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    distributions = context["__distributions"].split()
    places = [folder / name for name in distributions] if context["what"] == "pair" else [folder]
    configuration = folder / "train.yaml"
    run = Path("runs") / context["name"]
    projects = " ".join(f"-e '{place}[test]'" for place in places)  # the extra includes pytest
    following = [f"pip install {projects}", f"pytest {folder}"]
    if configuration.exists():
        from frobs_core.util.yaml import load_yaml

        environment = load_yaml(configuration)["environment"]
        following += [
            f"frobs train {environment} --config {configuration} --seed 0 --run-dir {run}",
            f"frobs evaluate {run}",
        ]
    elif context["what"] == "simulator":
        following.append(f"frobs evaluate {_SHIPPED} --pretrained --simulator {context['name']} --episodes 10")
    return {
        "name": context["name"],
        "kind": context["what"],
        "folder": str(folder),
        "distributions": distributions,
        "environment_id": context["__id"] or None,
        "answers": {question: context[question] for question in QUESTIONS if question in asked(context)},
        "files": sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()),
        "next": following,
    }


def _ask(given: Mapping[str, str]) -> dict[str, str]:
    from frobs_devkit.scaffold import fill_in, prompts

    answers, texts = dict(given), prompts()
    for question in QUESTIONS:
        if question in answers or question not in asked(answers):
            continue
        text = texts[question]
        if not isinstance(text, str):
            choices = {key: words for key, words in text.items() if key != "__prompt__"}
            for choice in CHOICES[question]:
                typer.echo(f"  {choice}{f': {choices[choice]}' if choice in choices else ''}", err=True)
            text = text["__prompt__"]
        while True:
            answer = typer.prompt(text, default=fill_in(answers)[question], err=True).strip()
            problem = find_problem({**answers, question: answer})
            if not problem:
                break
            print_note(problem)
        answers[question] = answer
    return answers
