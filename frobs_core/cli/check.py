"""``frobs check``: the conformance kit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from frobs_core.cli.catalogue import find_spec
from frobs_core.cli.options import EnvId, Json
from frobs_core.cli.output import console, only_json, print_json

if TYPE_CHECKING:
    from frobs_core.testing import Report, Result

_SIGNS = {
    "passed": ("✓", "green"),
    "failed": ("✗", "bold red"),
    "hollow": ("○", "yellow"),
    "not_applicable": ("–", "dim"),
}


def check(env_id: EnvId, json: Json = False) -> None:
    """Check that an environment keeps the contract: spaces, seeds, resets, vector against single.

    A check is hollow (○) where it ran and saw nothing that could have failed. Exits with 1 where one failed (✗).

    Example:
        $ frobs check frobs/Irb120Reach-v0
        $ frobs check CartPole-v1 --json
    """
    find_spec(env_id)
    from frobs_core.testing import check_env, run_checks

    with only_json(json):
        report = run_checks(check_env(env_id), None if json else _print_result)
    if json:
        print_json({"id": env_id, **report.as_dict()})
    else:
        console().print(_verdict(report), style="bold green" if report.ok else "bold red", soft_wrap=True)
    if not report.ok:
        raise typer.Exit(1)


def _print_result(result: Result) -> None:
    from rich.text import Text

    out = console()
    sign, style = _SIGNS[result.status]
    name = result.name.replace("_", " ")
    out.print(Text.assemble((f"{sign} ", style), name, (f"  {result.seconds:.1f} s", "dim")), soft_wrap=True)
    if result.message:
        for line in Text(result.message, style=style).wrap(out, max(out.width - 4, 20)):
            out.print(Text.assemble("    ", line), soft_wrap=True)


def _verdict(report: Report) -> str:
    counts = {status: sum(result.status == status for result in report.results) for status in _SIGNS}
    return ", ".join(f"{count} {status.replace('_', ' ')}" for status, count in counts.items() if count)
