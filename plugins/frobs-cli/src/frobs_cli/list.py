"""Implements ``frobs list``, which lists what is installed."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from frobs_cli import catalogue
from frobs_cli.completion import complete_kind
from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note, print_table, print_title
from frobs_cli.providers import providers
from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_core.plugins.records import KINDS


def list_(
    kind: Annotated[
        str | None,
        typer.Argument(
            metavar="[KIND]",
            show_default="all kinds",
            help="Kind to list: simulators, robots, controllers, tasks, algorithms, envs, capabilities, sensor_types, "
            "parameters, policies or commands.",
            autocompletion=complete_kind,
        ),
    ] = None,
    json: Json = False,
) -> None:
    """List what is installed: parts, environment IDs, extensions of plugins, and commands.

    Parts are simulators, robots, controllers, tasks and algorithms. Extensions are capabilities of simulators, sensor
    types, physical parameters that can be randomized, and policies.

    If a simulator's engine is not installed, the list shows how to install the engine.

    Example:
        $ frobs list
        $ frobs list envs
        $ frobs list robots --json
    """
    kinds = [*KINDS, catalogue.ENVIRONMENT, *catalogue.EXTENSIONS] if kind is None else [catalogue.kind_of(kind)]
    with only_json(json):
        rows = {kind: _environments() if kind == catalogue.ENVIRONMENT else _records(kind) for kind in kinds}
    if json:
        print_json({catalogue.plural(kind): facts for kind, facts in rows.items()})
        return
    for i, (kind_, facts) in enumerate(rows.items()):
        if i:
            print_line()
        if len(rows) > 1:
            print_title(catalogue.plural(kind_).replace("_", " "), "" if facts else "none installed")
        elif not facts:
            print_note(f"no {kind_} is installed")
        if facts:
            _print(kind_, facts)
    if any(
        report.state == "failed" for report in plugins.reports()
    ):  # the failed plugins were logged when they were loaded
        print_note("run 'frobs plugins --verbose' to see why plugins did not load")


def _records(kind: str) -> list[dict[str, Any]]:
    return [
        {
            "name": item.name,
            "summary": item.record.summary,
            "distribution": item.distribution,
            "version": item.version,
            **({"missing": catalogue.why_unusable(item.record)} if kind == "simulator" else {}),
        }
        for item in catalogue.listed(kind)
    ]


def _environments() -> list[dict[str, Any]]:
    return [
        {
            "id": env_id,
            "task": task.name,
            "robot": environment.robot or "any",
            "controller": environment.controller,
            "simulator": environment.simulator,
            "max_episode_steps": environment.max_episode_steps,
            "summary": environment.summary,
            **{key: fact for it in providers() for key, fact in it.environment(env_id, environment).items()},
        }
        for env_id, (task, environment) in registry.environments().items()
    ]


def _print(kind: str, facts: list[dict[str, Any]]) -> None:
    if kind == catalogue.ENVIRONMENT:
        columns = [[column for it in providers() if (column := it.column(fact))] for fact in facts]
        rows = [
            [fact["id"], fact["robot"], *(cell for _, cell in more), fact["summary"]]
            for fact, more in zip(facts, columns, strict=True)
        ]
        print_table(("ID", "robot", *(heading for heading, _ in columns[0]), "summary"), rows)
    else:
        rows = [
            [
                fact["name"],
                f"{fact['distribution']} {fact['version']}",
                fact["summary"] + (f" ({fact['missing']})" if fact.get("missing") else ""),
            ]
            for fact in facts
        ]
        print_table(("name", "from", "summary"), rows)
