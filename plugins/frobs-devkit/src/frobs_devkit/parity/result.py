"""Results of a measurement: judged numbers, facts, and curves to draw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from frobs_core.arrays import Floats
from frobs_devkit.parity.tolerances import TOLERANCES


class Status(StrEnum):
    """Outcome of a comparison."""

    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One number by which a simulator differs from its reference.

    Attributes:
        quantity: Name of the quantity.
        simulator: Simulator that is judged.
        against: Reference: another simulator, or ``"model file"``.
        status: Outcome.
        error: Largest difference; NaN if nothing was measured.
        tolerance: Largest error that passes; NaN if nothing was measured.
        unit: Unit of both.
        where: Joint, frame or time of the largest error.
        tolerance_name: Key of ``TOLERANCES``.
        reason: Why it was skipped, or why it failed without a number.
    """

    quantity: str
    simulator: str
    against: str
    status: Status
    error: float = math.nan
    tolerance: float = math.nan
    unit: str = ""
    where: str = ""
    tolerance_name: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Line:
    """One line of a panel.

    Attributes:
        label: Text in the legend; lines with the same label and color share an entry.
        x: (n,)
        y: (n,)
        color: Index in the palette; −1: the text color.
        simulator: Index of the simulator; 0 is the reference. It determines the line style.
        points: Whether to draw points instead of a line.
    """

    label: str
    x: Floats
    y: Floats
    color: int = 0
    simulator: int = 0
    points: bool = False


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One set of axes.

    Attributes:
        title: Title above the axes.
        x_label: Label with unit.
        y_label: Label with unit.
        lines: Lines to draw.
        tolerance: Value of a horizontal line.
        log: Whether y is logarithmic; zeros are drawn at the bottom.
        rows: Names of the rows 0, 1, …, for lines that show when a condition holds.
        map: Whether x and y are positions [m], drawn to the same scale.
        bars: Bars to draw instead of lines: label to (value, low, high).
    """

    title: str
    x_label: str = ""
    y_label: str = ""
    lines: tuple[Line, ...] = ()
    tolerance: float | None = None
    log: bool = False
    rows: tuple[str, ...] = ()
    map: bool = False
    bars: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """Result of one measurement.

    Attributes:
        summary: Description of the measurement in one or two sentences.
        comparisons: Judged comparisons; those that a simulator does not support are skipped.
        facts: Additional facts, by name.
        panels: Panels of its image.
        name: Lowercase with underscores; unique in a certificate, which sets it.
        title: Human-readable title; the certificate sets it.
    """

    summary: str
    comparisons: tuple[Comparison, ...]
    facts: Mapping[str, str] = field(default_factory=dict)
    panels: tuple[Panel, ...] = ()
    name: str = ""
    title: str = ""

    @property
    def status(self) -> Status:
        """Failed if any comparison failed, skipped if all were skipped."""
        found = {comparison.status for comparison in self.comparisons}
        return next((s for s in (Status.FAILED, Status.PASSED) if s in found), Status.SKIPPED)


def judge(
    tolerance_name: str,
    quantity: str,
    simulator: str,
    against: str,
    errors: Floats | float,
    *,
    exact: bool,
    scale: float = 1.0,
    least: float = 0.0,
    where: str = "",
    unit: str = "",
) -> Comparison:
    """Compare the largest of some errors with its tolerance; NaN fails.

    Args:
        tolerance_name: Key of ``TOLERANCES``.
        quantity: Name of the quantity.
        simulator: Simulator that is judged.
        against: Reference.
        errors: Absolute differences, of any shape.
        exact: Whether the exact tolerance applies, according to the claims of both simulators.
        scale: Value that an approximate tolerance is relative to, if it is relative.
        least: Minimum of an approximate tolerance, in ``unit``.
        where: Joint, frame or time of the largest error.
        unit: Unit that replaces the tolerance's.
    """
    tolerance = TOLERANCES[tolerance_name]
    allowed = tolerance.allowed(exact, scale) if exact else max(tolerance.allowed(exact, scale), least)
    error = float(np.max(np.asarray(errors, np.float64)))  # keeps NaN
    return Comparison(
        quantity=quantity,
        simulator=simulator,
        against=against,
        status=Status.PASSED if error <= allowed else Status.FAILED,
        error=error,
        tolerance=allowed,
        unit=unit or tolerance.unit,
        where=where if error else "",
        tolerance_name=tolerance_name,
    )


def worst(comparisons: Sequence[Comparison]) -> Comparison:
    """Return the comparison that is closest to its tolerance or exceeds it most."""

    def strain(comparison: Comparison) -> float:
        if math.isnan(comparison.error):
            return math.inf
        return comparison.error / comparison.tolerance if comparison.tolerance else comparison.error

    return max(comparisons, key=strain)


def skip(simulator: str, against: str, reason: str, quantity: str = "") -> Comparison:
    """Return a skipped comparison with its reason."""
    return Comparison(quantity=quantity, simulator=simulator, against=against, status=Status.SKIPPED, reason=reason)
