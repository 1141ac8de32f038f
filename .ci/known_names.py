"""Write ``frobs_core/plugins/known.json``: which distribution of this repository offers which names.

It reads the metadata and records of the installed distributions, so install all of them first::

    $ python .ci/known_names.py
"""

from __future__ import annotations

import json
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

from frobs_core import plugins
from frobs_core.plugins.collection import KNOWN_FILE
from frobs_core.plugins.discovery import normalize
from frobs_core.plugins.records import KINDS, PolicyRecord, ViewerRecord

ROOT = Path(__file__).resolve().parents[1]
_KINDS = (*KINDS, PolicyRecord.kind, ViewerRecord.kind)


def known_names() -> dict[str, dict[str, str]]:
    """Return the distribution of each name, by kind.

    Raises:
        RuntimeError: A plugin of the repository is not loaded.
    """
    projects = [ROOT / "pyproject.toml", *ROOT.glob("plugins/*/pyproject.toml")]
    names = {normalize(tomllib.loads(path.read_text("utf-8"))["project"]["name"]) for path in projects}
    found: dict[str, dict[str, str]] = {kind: {} for kind in (*_KINDS, "environment", "command")}
    for report in plugins.reports():
        if normalize(report.distribution) not in names:
            continue
        if report.state != "loaded":
            raise RuntimeError(f"plugin '{report.name}' of {report.origin} is {report.state}: {report.cause}")
        for kind in _KINDS:
            found[kind].update({record.name: report.distribution for record in report.records[kind]})
        found["environment"].update(dict.fromkeys(report.environment_ids, report.distribution))
    for entry in entry_points(group="frobs.commands"):
        if entry.dist is not None and normalize(entry.dist.name) in names:
            found["command"].update({command.name: entry.dist.name for command in entry.load()})
    return {kind: dict(sorted(of_kind.items())) for kind, of_kind in found.items()}


if __name__ == "__main__":
    KNOWN_FILE.write_text(json.dumps(known_names(), indent=2) + "\n", encoding="utf-8")
