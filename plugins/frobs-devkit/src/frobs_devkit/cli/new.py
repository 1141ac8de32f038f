"""``frobs new``: creates a plugin from templates."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from frobs_cli.facts import print_facts
from frobs_cli.model_options import PackagePath, XacroArgs
from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note, print_title
from frobs_core.util.errors import MissingSettingError
from frobs_devkit.scaffold.answers import CHOICES, QUESTIONS, asked, find_problem

_SHIPPED = "frobs/Irb120Reach-v0"  # an ID with a trained policy


def new(
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
    example: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default="arm; file if --robot-file is given",
            help="Example to start from: arm (reaches for a goal), wheeled (drives to a goal) or file (your own arm).",
        ),
    ] = None,
    paced: Annotated[
        bool,
        typer.Option(
            "--paced",
            help="Create a simulator whose world advances on its own, such as an interface to a real robot.",
        ),
    ] = False,
    robot_file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", show_default=False, help="Model file of your arm: URDF, xacro or MJCF."),
    ] = None,
    tcp: Annotated[
        str | None,
        typer.Option(
            metavar="LINK",
            show_default="the most likely link",
            help="Link of your arm that serves as the tool center point (TCP).",
        ),
    ] = None,
    args: XacroArgs = None,
    package_path: PackagePath = None,
    failing_checks: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default="reject",
            help="What to do if --robot-file fails conformance checks: reject the file, or expect these failures "
            "in the plugin's tests.",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default="irb120",
            help="Installed robot that performs the new task. Requires WHAT to be task.",
        ),
    ] = None,
    namespace: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", show_default="lab", help="Namespace of the Gymnasium IDs (the part before the slash)."
        ),
    ] = None,
    author: Annotated[
        str | None, typer.Option(metavar="NAME", show_default="Your Name", help="Copyright holder.")
    ] = None,
    license: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", show_default="MIT", help=f"License of the plugin: {', '.join(CHOICES['license'])}."
        ),
    ] = None,
    ci: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default="github",
            help=f"CI service that runs the tests on each push: {', '.join(CHOICES['ci'])}.",
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option(
            metavar="DIR", show_default="the current folder", help="Folder in which to create the plugin's folder."
        ),
    ] = Path(),
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
    import os

    from frobs_devkit.scaffold import render, resolve

    flags: dict[str, str | None] = {
        "what": what,
        "example": "file" if robot_file is not None and example is None else example,
        "paced": "yes" if paced else None,
        "name": name,
        "robot_file": None if robot_file is None else str(robot_file.expanduser().absolute()),
        "tcp": tcp,
        "xacro_args": " ".join(args) if args else None,
        "package_paths": os.pathsep.join(package_path) if package_path else None,
        "failing_checks": failing_checks,
        "robot": robot,
        "namespace": namespace,
        "author": author,
        "license": license,
        "ci": ci,
    }
    given = {question: answer for question, answer in flags.items() if answer is not None}
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
        folder = render(context, output)
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
    """Ask for missing answers. Invalid answers are reported immediately."""
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
