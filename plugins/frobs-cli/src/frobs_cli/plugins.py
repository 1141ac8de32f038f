"""Implements ``frobs plugins``, which shows the state of each installed plugin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.catalogue import plural
from frobs_cli.options import Json
from frobs_cli.output import console, only_json, print_json, print_line, print_note, print_table, print_title
from frobs_core.plugins import PluginReport, registry, reports
from frobs_core.plugins.records import Record
from frobs_core.util.install_hints import local_install_hint

if TYPE_CHECKING:
    from rich.text import Text

_KEYS = [
    "name",
    "distribution",
    "version",
    "module",
    "state",
    "cause",
    "warning",
    "made_for",
    "traceback",
    "import_seconds",
]
_STATES = {"loaded": "green", "failed": "bold red", "disabled": "yellow"}


def plugins(
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Also show modules, import times, records and tracebacks.")
    ] = False,
    json: Json = False,
) -> None:
    """Show whether each installed plugin was loaded, failed to load, or is disabled.

    If a plugin failed to load, the output also shows the cause. The output also lists unavailable environment IDs.

    Example:
        $ frobs plugins
        $ frobs plugins --verbose
        $ FROBS_DISABLE_PLUGINS=my-plugin frobs plugins
    """
    with only_json(json):
        listed = sorted(reports(), key=lambda report: (report.distribution, report.name))
    if json:
        print_json({"plugins": [_facts(report) for report in listed], "problems": dict(registry.problems())})
        return
    if not listed:
        hint = local_install_hint("pip install frobs-sim-mujoco")
        print_note(f"no plugins are installed; install one, for example with '{hint}'")
    elif verbose:
        for i, report in enumerate(listed):
            if i:
                print_line()
            _print_verbose(report)
    else:
        rows: list[list[str | Text]] = [
            [r.name, _state(r), f"{r.distribution} {r.version}", r.cause or _counts(r.records)] for r in listed
        ]
        print_table(("plugin", "state", "from", "offers"), rows)
    for line in [report.warning for report in listed if report.warning] + list(registry.problems().values()):
        print_note(line)


def _facts(report: PluginReport) -> dict[str, object]:
    return {
        **{key: getattr(report, key) for key in _KEYS},
        "records": {plural(kind): [record.name for record in records] for kind, records in report.records.items()},
    }


def _counts(records: Mapping[str, Sequence[Record]]) -> str:
    """Return the number of records of each kind as text, such as ``"1 robot, 4 tasks"``."""
    words = [
        f"{len(items)} {kind if len(items) == 1 else plural(kind)}" for kind, items in records.items() if len(items)
    ]
    return ", ".join(words) or "nothing"


def _state(report: PluginReport) -> Text:
    from rich.text import Text

    return Text(report.state, style=_STATES.get(report.state, ""))


def _print_verbose(report: PluginReport) -> None:
    from rich.text import Text

    print_title(report.name, f"{report.distribution} {report.version}")
    rows: list[list[str | Text]] = [["state", _state(report)], ["module", report.module]]
    if report.cause:
        rows.append(["cause", report.cause])
    if report.made_for:
        rows.append(["requires", f"frobs-core {report.made_for}"])
    if report.state != "disabled":
        rows.append(["import", f"{report.import_seconds * 1e3:.0f} ms"])
    rows += [[plural(kind), ", ".join(r.name for r in items)] for kind, items in report.records.items() if len(items)]
    print_table(("", ""), rows, header=False)
    if report.traceback:
        for line in report.traceback.rstrip().splitlines():
            console().print(Text(f"  │ {line}", style="dim"), soft_wrap=True)
