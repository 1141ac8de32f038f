"""Paths through joint space that consist of straight lines with rounded corners."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from frobs_core.util.arrays import Floats


class RoundedPath:
    """Path of straight lines between waypoints, with a parabola at each corner to make the direction continuous.

    The path parameter is the length of the path without rounding, in joint space. On each piece (a line or a parabola),
    the second derivative is constant.

    Args:
        waypoints: Waypoints, (n, dof) [rad or m], n ≥ 2, without consecutive duplicates.
        radii: Rounding distances in joint space, (n − 2,), > 0. At each corner, a parabola replaces the last part of
            one line and the first part of the next line, each of this length. The radii of two adjacent corners add up
            to at most the length of the line between them.

    Attributes:
        breaks: Path parameters at the ends of the m pieces, (m + 1,). The first value is 0.
    """

    def __init__(self, waypoints: Floats, radii: Floats) -> None:
        steps = np.diff(waypoints, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        directions = steps / lengths[:, None]
        cut = np.concatenate([[0.0], radii, [0.0]])
        breaks, starts, slopes, bends = [0.0], [], [], []

        def add(length: float, start: Floats, slope: Floats, bend: Floats) -> None:
            if length > 1e-12:
                breaks.append(breaks[-1] + length)
                starts.append(start)
                slopes.append(slope)
                bends.append(bend)

        for i, direction in enumerate(directions):
            begin = waypoints[i] + cut[i] * direction
            add(lengths[i] - cut[i] - cut[i + 1], begin, direction, np.zeros_like(direction))
            if i + 1 < len(directions):
                corner, radius = waypoints[i + 1], cut[i + 1]
                bend = (directions[i + 1] - direction) / (2.0 * radius)
                add(2.0 * radius, corner - radius * direction, direction, bend)
        self.breaks = np.array(breaks)
        self._starts, self._slopes, self._bends = np.array(starts), np.array(slopes), np.array(bends)

    @property
    def length(self) -> float:
        """Path parameter at the end of the path."""
        return float(self.breaks[-1])

    def evaluate(self, at: Floats, piece: npt.NDArray[np.intp] | None = None) -> tuple[Floats, Floats, Floats]:
        """Return the positions and their first and second derivatives, (k, dof) each.

        Args:
            at: Path parameters in [0, length], (k,).
            piece: Index of the piece to which each parameter belongs, (k,). If None, the later piece is used where two
                pieces meet.
        """
        if piece is None:
            piece = np.searchsorted(self.breaks, at, side="right") - 1
        piece = np.clip(piece, 0, len(self._starts) - 1)
        s = (at - self.breaks[piece])[:, None]
        start, slope, bend = self._starts[piece], self._slopes[piece], self._bends[piece]
        return start + s * (slope + 0.5 * s * bend), slope + s * bend, bend
