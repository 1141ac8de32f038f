"""Results of a measurement: comparisons, facts, and curves to draw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_devkit.parity.tolerances import TOLERANCES


class Status(StrEnum):
    """Outcome of a comparison."""

    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Comparison of one quantity between a simulator and its reference.

    Attributes:
        quantity: Name of the quantity.
        simulator: Name of the simulator that is compared with the reference.
        against: Name of the reference, which is another simulator or ``"model file"``.
        status: Outcome of the comparison.
        error: Largest difference, or NaN if nothing was measured.
        tolerance: Largest error that is allowed, or NaN if nothing was measured.
        unit: Unit of the error and the tolerance.
        where: Joint, frame or time of the largest error.
        tolerance_name: Key of ``TOLERANCES``.
        reason: Why the comparison was skipped, or why it failed without a measured error.
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
        label: Text in the legend. Lines with the same label and color share a legend entry.
        x: Horizontal coordinates, (n,).
        y: Vertical coordinates, (n,).
        color: Index in the color palette, or −1 for the text color.
        simulator: Index of the simulator, which determines the line style. The reference has index 0.
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
    """One set of axes in the image of a measurement.

    Attributes:
        title: Title above the axes.
        x_label: Label of the x axis, with unit.
        y_label: Label of the y axis, with unit.
        lines: Lines to draw.
        tolerance: Tolerance that is drawn as a horizontal line.
        log: Whether the y axis is logarithmic. On a logarithmic axis, zeros are drawn at the bottom.
        rows: Names of the rows at y = 0, 1, …, if the lines show when a condition is met.
        map: Whether x and y are positions [m], drawn to the same scale.
        bars: Bars to draw instead of lines, as a mapping from label to (value, low, high).
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
        comparisons: Results of the comparisons. Comparisons that a simulator does not support are skipped.
        facts: Additional facts, by name.
        panels: Panels of the image.
        name: Unique name in the certificate, in lowercase with underscores. ``measure_parity`` sets the name.
        title: Human-readable title. ``measure_parity`` sets the title.
    """

    summary: str
    comparisons: tuple[Comparison, ...]
    facts: Mapping[str, str] = field(default_factory=dict)
    panels: tuple[Panel, ...] = ()
    name: str = ""
    title: str = ""

    @property
    def status(self) -> Status:
        """Overall outcome: failed if any comparison failed, skipped if all were skipped, and passed otherwise."""
        statuses = {comparison.status for comparison in self.comparisons}
        return next((s for s in (Status.FAILED, Status.PASSED) if s in statuses), Status.SKIPPED)


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
    """Compare the largest of the absolute errors (any shape) with a tolerance. An error of NaN fails the comparison.

    ``exact`` depends on the capability levels that both simulators claim. ``scale`` multiplies a relative approximate
    tolerance, and ``least`` is the lower bound of an approximate one, in ``unit``, which replaces the tolerance's unit.
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


def error_panel(title: str, lines: Sequence[Line], unit: str, tolerance: float | None, x_label: str = "s") -> Panel:
    """Return a panel with errors on a logarithmic axis."""
    return Panel(title=title, x_label=x_label, y_label=unit, lines=tuple(lines), tolerance=tolerance, log=True)


def worst(comparisons: Sequence[Comparison]) -> Comparison:
    """Return the comparison with the largest ratio of error to tolerance."""

    def strain(comparison: Comparison) -> float:
        if math.isnan(comparison.error):
            return math.inf
        return comparison.error / comparison.tolerance if comparison.tolerance else comparison.error

    return max(comparisons, key=strain)


def skip(simulator: str, against: str, reason: str, quantity: str = "") -> Comparison:
    """Return a skipped comparison with the given reason."""
    return Comparison(quantity=quantity, simulator=simulator, against=against, status=Status.SKIPPED, reason=reason)
