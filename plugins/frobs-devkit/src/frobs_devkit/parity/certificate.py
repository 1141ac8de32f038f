"""Certificate with all results and versions, which can be written to files, and its Markdown page."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.files import write_aside, write_json, write_text
from frobs_core.util.plain import plain
from frobs_devkit.parity.actions import ActionFile
from frobs_devkit.parity.draw import draw
from frobs_devkit.parity.result import Comparison, Measurement, Status
from frobs_devkit.parity.tolerances import TOLERANCES

FORMAT = 1
"""Version of the format, which increases when the meaning of ``certificate.json`` changes."""

NAME = "certificate.json"
"""Name of the file that is removed first and written last, so that a folder with this file is always complete."""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Results of all measurements for one environment.

    Attributes:
        id: Gymnasium ID.
        reference: Label of the reference simulator.
        simulators: Labels of all simulators, starting with the reference.
        facts: Facts about the environment, such as the robot, the controller and the timesteps.
        measurements: Measurements in execution order.
        versions: Versions of Python, NumPy, the engines and all FRobs distributions, and a description of the machine.
        actions: Replayed actions, or None if no actions were replayed.
    """

    id: str
    reference: str
    simulators: tuple[str, ...]
    facts: Mapping[str, str]
    measurements: tuple[Measurement, ...]
    versions: Mapping[str, Any]
    actions: ActionFile | None = None

    @property
    def passed(self) -> bool:
        """Whether at least one comparison was made and no error exceeds its tolerance."""
        statuses = {measurement.status for measurement in self.measurements}
        return Status.FAILED not in statuses and Status.PASSED in statuses

    @property
    def verdict(self) -> str:
        """Summary of the comparisons, such as ``"18 passed, 1 failed, 2 skipped"``."""
        statuses = [comparison.status for m in self.measurements for comparison in m.comparisons]
        counts = {status: statuses.count(status) for status in Status}
        return ", ".join(f"{count} {status}" for status, count in counts.items() if count)

    def to_dict(self) -> dict[str, Any]:
        """Return the certificate as JSON-compatible values, with None for numbers that were not measured."""
        return {
            "format": FORMAT,
            "id": self.id,
            "passed": self.passed,
            "verdict": self.verdict,
            "reference": self.reference,
            "simulators": list(self.simulators),
            "facts": dict(self.facts),
            "measurements": [
                {
                    **{
                        key: plain(getattr(m, key))
                        for key in ("name", "title", "summary", "status", "comparisons", "facts")
                    },
                    "picture": f"{m.name}.png" if m.panels else None,
                }
                for m in self.measurements
            ],
            "versions": dict(self.versions),
        }

    def write(self, folder: Path) -> None:
        """Write ``certificate.json``, ``certificate.md``, a PNG file for each measurement, the curves and the actions.

        All images are drawn before the first file is changed. ``certificate.json`` is removed first and written last,
        so that a folder that contains this file is complete.

        Raises:
            ConfigurationError: The folder cannot be created.
            RunError: matplotlib is not installed.
        """
        pictures = {f"{m.name}.png": draw(m, self.simulators) for m in self.measurements if m.panels}
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(
                f"the folder {folder} cannot be created: {error.strerror}; choose another folder with --out."
            ) from error
        stale = _pictures_of(folder / NAME) - pictures.keys()
        (folder / NAME).unlink(missing_ok=True)
        for name in stale:
            (folder / name).unlink(missing_ok=True)
        for name, picture in pictures.items():
            write_aside(folder / name, partial(Path.write_bytes, data=picture))
        write_aside(folder / "curves.npz", lambda aside: np.savez_compressed(aside, **curves(self.measurements)))  # type: ignore[arg-type]
        if self.actions is not None:
            self.actions.write(folder / "actions.json")
        write_text(folder / "certificate.md", markdown(self))
        write_json(folder / NAME, self.to_dict())


def curves(measurements: Sequence[Measurement]) -> dict[str, Floats]:
    """Return the curves of all plots as arrays (2, n), keyed by ``measurement/panel/label/simulator``."""
    return {
        f"{measurement.name}/{p}/{line.label}/{line.simulator}": np.stack([line.x, line.y])
        for measurement in measurements
        for p, panel in enumerate(measurement.panels)
        for line in panel.lines
    }


def _pictures_of(path: Path) -> set[str]:
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        pictures = {m["picture"] for m in json.loads(path.read_text("utf-8"))["measurements"] if m["picture"]}
        return {name for name in pictures if Path(name).name == name and name.endswith(".png")}
    return set()


SIGNS: Mapping[Status, str] = {Status.PASSED: "✓", Status.FAILED: "✗", Status.SKIPPED: "–"}
"""Symbols for the outcomes of comparisons in tables."""


def markdown(certificate: Certificate) -> str:
    """Return the certificate as a Markdown page with a verdict, a table, descriptions, tolerances and versions."""
    others, flat = ", ".join(certificate.simulators[1:]), dict[str, str]()
    for name, value in certificate.versions.items():
        flat |= {key: str(each) for key, each in (value if isinstance(value, Mapping) else {name: value}).items()}
    sections = [
        f"# Parity of {certificate.id}",
        f"**{'Passed' if certificate.passed else 'Not passed'}**: {certificate.verdict}.\n"
        f"{others} compared with {certificate.reference}, quantity by quantity.",
        _table(certificate.facts),
        _overview(certificate),
        *(part for measurement in certificate.measurements for part in _section(measurement)),
        *_tolerances(certificate),
        "## Versions",
        _table(flat),
    ]
    return "\n\n".join(sections) + "\n"


def number(value: float, unit: str = "") -> str:
    """Return an error or a tolerance as text, such as ``"1.2e-14 rad"``, ``"0"``, or ``"–"`` for NaN."""
    if math.isnan(value):
        return "–"
    if value == 0.0:
        return "0"
    return f"{value:.2g} {unit}".replace("e-0", "e-").strip()


def rows(measurement: Measurement) -> Iterator[tuple[Comparison, tuple[str, str, str, str, str]]]:
    """Yield each comparison with its table cells: simulator, quantity, error, tolerance and note."""
    for comparison in measurement.comparisons:
        yield (
            comparison,
            (
                comparison.simulator,
                comparison.quantity or measurement.title.lower(),
                number(comparison.error, comparison.unit),
                number(comparison.tolerance),
                comparison.reason or comparison.where,
            ),
        )


def _overview(certificate: Certificate) -> str:
    lines = ["| measurement | simulator | quantity | error | tolerance | |", "|---|---|---|---:|---:|:-:|"]
    for measurement in certificate.measurements:
        for i, (comparison, cells) in enumerate(rows(measurement)):
            anchor = "".join(c for c in measurement.title.lower().replace(" ", "-") if c.isalnum() or c == "-")
            title = f"[{measurement.title}](#{anchor})" if i == 0 else ""
            lines.append(_row(title, *cells[:4], SIGNS[comparison.status]))
    return "\n".join(lines)


def _section(measurement: Measurement) -> Iterator[str]:
    yield f"## {measurement.title}"
    yield measurement.summary
    lines = []
    for comparison, (simulator, quantity, error, tolerance, note) in rows(measurement):
        judged = f"{error}, allowed {tolerance}" if not math.isnan(comparison.error) else str(comparison.status)
        against = f" against {comparison.against}" if comparison.against else ""
        lines.append(
            f"- {SIGNS[comparison.status]} {simulator}{against}, {quantity}: {judged}{f' ({note})' if note else ''}"
        )
    yield "\n".join([*lines, *(f"- {what}: {fact}" for what, fact in measurement.facts.items())])
    if measurement.panels:
        yield f"![{measurement.title}]({measurement.name}.png)"


def _tolerances(certificate: Certificate) -> Iterator[str]:
    used = {c.tolerance_name: c for m in certificate.measurements for c in m.comparisons if c.tolerance_name}
    if used:
        yield "## Why these tolerances"
        yield "\n".join(f"- **{name.replace('_', ' ')}**: {TOLERANCES[name].reason}" for name in used)


def _table(lines: Mapping[str, str]) -> str:
    return "\n".join([_row("", ""), "|---|---|", *(_row(*line) for line in lines.items())])


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', '&#124;') for cell in cells)} |"
