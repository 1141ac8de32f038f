"""What a measurement gives: numbers that are judged, facts, and curves to draw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from frobs_core.arrays import Floats
from frobs_devkit.parity.tolerances import TOLERANCES


class Status(StrEnum):
    """How a comparison came out."""

    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One number by which a simulator differs from what it is compared with.

    Attributes:
        quantity: What differs, in words.
        simulator: The one that is judged.
        against: What it is compared with: another simulator, or ``"model file"``.
        status: How it came out.
        error: Largest difference; NaN where nothing was measured.
        tolerance: Largest error that passes; NaN where nothing was measured.
        unit: Of both.
        where: At which joint, frame or time the error is largest.
        tolerance_name: Key of ``TOLERANCES``.
        reason: Why it was skipped, or failed without a number.
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
        label: In the legend; lines of one label and colour share an entry.
        x: (n,)
        y: (n,)
        color: Which colour of the palette; −1: that of text.
        simulator: Which simulator it is of: 0 is the reference. It decides the stroke.
        points: Draw points rather than a stroke.
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
        title: Above it.
        x_label: With the unit.
        y_label: With the unit.
        lines: What it shows.
        tolerance: Drawn as a horizontal line.
        log: Whether y is logarithmic; zeros are drawn at the bottom.
        rows: Names of the rows 0, 1, …, for lines that tell when something is so.
        map: Whether x and y are a place [m], drawn to one scale.
        bars: For a panel of bars instead of lines: label to (value, low, high).
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
    """What one measurement found.

    Attributes:
        summary: What was done, in one or two sentences.
        comparisons: What was judged; what a simulator cannot do is in it as skipped.
        facts: What else there is to know, by what it is.
        panels: What its picture shows.
        name: Lower case with underscores; unique in a certificate, which sets it.
        title: For people; the certificate sets it.
    """

    summary: str
    comparisons: tuple[Comparison, ...]
    facts: Mapping[str, str] = field(default_factory=dict)
    panels: tuple[Panel, ...] = ()
    name: str = ""
    title: str = ""

    @property
    def status(self) -> Status:
        """Failed if any comparison did, skipped if all were."""
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
    """Return a comparison of the largest of some errors with its tolerance; NaN fails.

    Args:
        tolerance_name: Key of ``TOLERANCES``.
        quantity: What differs, in words.
        simulator: The one that is judged.
        against: What it is compared with.
        errors: Absolute differences, of any shape.
        exact: Whether what both simulators claim makes the exact tolerance right.
        scale: What an approximate tolerance is a share of, where it is one.
        least: What an approximate tolerance is at least, in ``unit``.
        where: At which joint, frame or time the error is largest.
        unit: In place of the tolerance's.
    """
    tolerance = TOLERANCES[tolerance_name]
    allowed = tolerance.allowed(exact, scale) if exact else max(tolerance.allowed(exact, scale), least)
    error = float(np.max(np.asarray(errors, np.float64)))  # a NaN stays one
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
    """Return the comparison that comes nearest to its tolerance, or exceeds it most."""

    def strain(comparison: Comparison) -> float:
        if math.isnan(comparison.error):
            return math.inf
        return comparison.error / comparison.tolerance if comparison.tolerance else comparison.error

    return max(comparisons, key=strain)


def skip(simulator: str, against: str, reason: str, quantity: str = "") -> Comparison:
    """Return a comparison that was not made, and why."""
    return Comparison(quantity=quantity, simulator=simulator, against=against, status=Status.SKIPPED, reason=reason)
