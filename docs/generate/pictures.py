"""The pictures of the environments' pages: the learning curve of the policy that is shipped."""

from __future__ import annotations

import io
from pathlib import Path

from frobs_core.util.errors import FrobsError
from frobs_train.plots.figures import dress, make_figure


def draw_curve(curve: dict[str, list[float | None]], path: Path) -> bool:
    """Draw the learning curve that a bundle tells: success, or else reward, over the time of the training.

    Returns:
        Whether there was anything to draw.
    """
    if len(curve.get("steps") or []) < 2:
        return False
    known = "success" if any(value is not None for value in curve["success"]) else "reward"
    rows = [(s, t, v) for s, t, v in zip(curve["steps"], curve["seconds"], curve[known], strict=True) if v is not None]
    try:
        figure = make_figure(6.4, 2.6)
    except FrobsError:
        return False
    axis = figure.subplots()
    dress(axis, x_label="environment steps", y_label=f"{known} in the training")
    axis.plot([row[0] for row in rows], [row[2] for row in rows], color="#b3450b", linewidth=2)
    if known == "success":
        axis.set_ylim(0.0, 1.03)
    axis.set_xlim(0, rows[-1][0])
    axis.xaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150, metadata={"Software": None})
    _write(buffer.getvalue(), path)
    return True


def _write(data: bytes, path: Path) -> None:
    """Write a file, but not if it is there already: Sphinx builds anew what is younger."""
    if not path.exists() or path.read_bytes() != data:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
