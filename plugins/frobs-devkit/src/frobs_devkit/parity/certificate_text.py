"""Writes the certificate as Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from frobs_devkit.parity.result import Comparison, Measurement, Status
from frobs_devkit.parity.tolerances import TOLERANCES

if TYPE_CHECKING:
    from frobs_devkit.parity.certificate import Certificate

SIGNS: Mapping[Status, str] = {Status.PASSED: "✓", Status.FAILED: "✗", Status.SKIPPED: "–"}
"""Symbols for the outcomes of comparisons in tables."""


def markdown(certificate: Certificate) -> str:
    """Return the certificate as a Markdown page with a verdict, a table, descriptions, tolerances and versions."""
    others = ", ".join(certificate.simulators[1:])
    sections = [
        f"# Parity of {certificate.id}",
        f"**{'Passed' if certificate.passed else 'Not passed'}**: {certificate.verdict}.\n"
        f"{others} compared with {certificate.reference}, quantity by quantity.",
        _table(certificate.facts),
        _overview(certificate),
        *(part for measurement in certificate.measurements for part in _section(measurement)),
        *_tolerances(certificate),
        "## Versions",
        _table(dict(_flat(certificate.versions))),
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


def _flat(versions: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for name, value in versions.items():
        if isinstance(value, Mapping):
            yield from ((str(inner), str(version)) for inner, version in value.items())
        else:
            yield name, str(value)
