"""The certificate as Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from frobs_devkit.parity.result import Comparison, Measurement, Status
from frobs_devkit.parity.tolerances import TOLERANCES

if TYPE_CHECKING:
    from frobs_devkit.parity.certificate import Certificate

SIGNS: Mapping[Status, str] = {Status.PASSED: "✓", Status.FAILED: "✗", Status.SKIPPED: "–"}
"""What tables show for each outcome."""


def markdown(certificate: Certificate) -> str:
    """Return the certificate as a page: verdict, table, what was measured, tolerances and versions."""
    return "\n".join(_page(certificate)) + "\n"


def number(value: float, unit: str = "") -> str:
    """Return an error or a tolerance as people read it: ``"1.2e-14 rad"``, ``"0"``, ``"–"``."""
    if math.isnan(value):
        return "–"
    if value == 0.0:
        return "0"
    return f"{value:.2g} {unit}".replace("e-0", "e-").strip()


def rows(measurement: Measurement) -> Iterator[tuple[Comparison, tuple[str, str, str, str, str]]]:
    """Yield each comparison with its cells: simulator, quantity, error, tolerance, note."""
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


def _page(certificate: Certificate) -> Iterator[str]:
    others = ", ".join(certificate.simulators[1:])
    yield f"# Parity of {certificate.id}"
    yield ""
    yield f"**{'Passed' if certificate.passed else 'Not passed'}**: {certificate.verdict}."
    yield f"{others} compared with {certificate.reference}, quantity by quantity."
    yield ""
    yield from _table(("", ""), list(certificate.facts.items()))
    yield ""
    yield "| measurement | simulator | quantity | error | tolerance | |"
    yield "|---|---|---|---:|---:|:-:|"
    for measurement in certificate.measurements:
        for i, (comparison, cells) in enumerate(rows(measurement)):
            simulator, quantity, error, tolerance, _ = cells
            title = f"[{measurement.title}](#{_anchor(measurement.title)})" if i == 0 else ""
            yield _row(title, simulator, quantity, error, tolerance, SIGNS[comparison.status])
    yield ""
    for measurement in certificate.measurements:
        yield from _section(measurement)
    yield from _tolerances(certificate)
    yield "## Versions"
    yield ""
    yield from _table(("", ""), list(dict(_flat(certificate.versions)).items()))


def _section(measurement: Measurement) -> Iterator[str]:
    yield f"## {measurement.title}"
    yield ""
    yield measurement.summary
    yield ""
    for comparison, (simulator, quantity, error, tolerance, note) in rows(measurement):
        judged = f"{error}, allowed {tolerance}" if not math.isnan(comparison.error) else str(comparison.status)
        against = f" against {comparison.against}" if comparison.against else ""
        yield f"- {SIGNS[comparison.status]} {simulator}{against}, {quantity}: {judged}{f' ({note})' if note else ''}"
    yield from (f"- {what}: {fact}" for what, fact in measurement.facts.items())
    if measurement.panels:
        yield ""
        yield f"![{measurement.title}]({measurement.name}.png)"
    yield ""


def _tolerances(certificate: Certificate) -> Iterator[str]:
    used = {c.tolerance_name: c for m in certificate.measurements for c in m.comparisons if c.tolerance_name}
    if not used:
        return
    yield "## Why these tolerances"
    yield ""
    for name in used:
        tolerance = TOLERANCES[name]
        yield f"- **{name.replace('_', ' ')}**: {tolerance.reason}"
    yield ""


def _table(head: tuple[str, ...], lines: list[tuple[str, str]]) -> Iterator[str]:
    yield _row(*head)
    yield "|" + "---|" * len(head)
    for line in lines:
        yield _row(*line)


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', '&#124;') for cell in cells)} |"


def _flat(versions: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for name, value in versions.items():
        if isinstance(value, Mapping):
            yield from ((str(inner), str(version)) for inner, version in value.items())
        else:
            yield name, str(value)


def _anchor(title: str) -> str:
    """Return the anchor that Markdown gives a heading."""
    return "".join(c for c in title.lower().replace(" ", "-") if c.isalnum() or c == "-")
