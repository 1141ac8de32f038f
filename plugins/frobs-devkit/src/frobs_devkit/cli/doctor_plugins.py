"""``frobs doctor plugins``: finds problems in installed plugins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.options import Json
from frobs_cli.output import console, only_json, print_json, print_line, print_note, print_table, print_title
from frobs_core.plugins import active
from frobs_core.util.errors import UnknownNameError
from frobs_core.util.install_hints import local_install_hint

if TYPE_CHECKING:
    from rich.text import Text

    from frobs_devkit.doctor.plugins import PluginFacts

_STATES = {"loaded": "green", "failed": "bold red", "hanging": "bold red", "crashed": "bold red"}


def plugins(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            show_default=False,
            help="Plugins or distributions to examine. By default, all installed plugins are examined.",
        ),
    ] = None,
    timeout: Annotated[
        float, typer.Option(metavar="S", min=0.1, help="Time limit for importing each plugin, in seconds.")
    ] = 30.0,
    json: Json = False,
) -> None:
    """Import each installed plugin in its own process and report problems.

    For each plugin, the command reports the import time, the records that the plugin provides, any output or changes to
    global state during the import, and missing requirements. If a plugin is broken or its import hangs, the command
    also prints the traceback. A broken plugin cannot affect the command itself. Exits with status 1 if any plugin
    cannot be used.

    Example:
        $ frobs doctor plugins
        $ frobs doctor plugins frobs-robots-abb --timeout 5
        $ frobs doctor plugins --json
    """
    from frobs_devkit.doctor.plugins import examine_plugins

    known = [word for c in active().candidates() for word in (c.name, c.distribution, c.key)]
    for name in names or ():
        if name not in known:
            raise UnknownNameError("plugin", name, set(known))
    with only_json(json):
        reports = examine_plugins(timeout, names or ())
    if json:
        print_json({"plugins": reports})
    elif not reports:
        hint = local_install_hint("pip install frobs-sim-mujoco")
        print_note(f"no plugins are installed; install one, for example with '{hint}'")
    else:
        _print(reports)
    if not all(facts.sound for facts in reports):
        raise typer.Exit(1)


def _print(found: tuple[PluginFacts, ...]) -> None:
    from rich.text import Text

    from frobs_devkit.cli.doctor_report import print_findings

    rows: list[list[str | Text]] = []
    for facts in found:
        offers = [
            f"{len(names)} {kind}{'' if len(names) == 1 else 's'}" for kind, names in facts.records.items() if names
        ]
        state = Text(facts.state + (", disabled" if facts.disabled else ""), style=_STATES[facts.state])
        rows.append([facts.name, state, f"{1e3 * facts.import_seconds:.0f} ms", f"{facts.distribution} {facts.version}",
                     facts.made_for or "–", ", ".join(offers) or "nothing"])  # fmt: skip
    print_table(("plugin", "state", "import", "from", "requires core", "provides"), rows)
    for facts in found:
        if facts.findings:
            print_line()
            print_title(facts.name, f"{facts.distribution} {facts.version}")
            print_findings(facts.findings)
            for line in facts.traceback.rstrip().splitlines():
                console().print(Text(f"  │ {line}", style="dim"), soft_wrap=True)
    broken = sum(not facts.sound for facts in found)
    remarked = sum(facts.sound and bool(facts.findings) for facts in found)
    print_line()
    verdict = f"{len(found)} examined, {broken} broken, {remarked} with other findings"
    console().print(Text(verdict, style="bold red" if broken else "bold green"), soft_wrap=True)
