"""Draws an overview of a data set."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from frobs_core.util.files import write_aside
from frobs_data.dataset import Dataset
from frobs_train import COLORS, dress, make_figure

_MOST = 6
"""Maximum number of first pictures, and of elements of an action, in a figure."""


def draw(dataset: Dataset, out: Path) -> Path:
    """Draw the first pictures of some episodes, and the distribution of each element of the actions.

    Args:
        dataset: The data set.
        out: PNG file to write.

    Returns:
        The file.
    """
    cameras, count = dataset.info.cameras, len(dataset.episodes)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST)).astype(int)) if count else np.zeros(0, int)
    figure = make_figure(10.0, 2.6 + 1.8 * len(cameras))
    rows = figure.subfigures(len(cameras) + 1, 1, squeeze=False)[:, 0]
    for camera, row in zip(cameras, rows, strict=False):
        row.suptitle(camera, fontsize=9)
        for axis, episode in zip(row.subplots(1, _MOST), chosen, strict=False):
            axis.imshow(next(dataset.iter_pictures(int(episode), camera)))
            axis.set_title(f"episode {episode}", fontsize=8)
        for axis in row.axes:
            axis.axis("off")
    action = dataset.features.get("action")
    if action is not None and action.is_numeric and count:
        values = dataset.columns(["action"])["action"].reshape(len(dataset), -1)[:, :_MOST]
        for index, axis in enumerate(rows[-1].subplots(1, values.shape[1], squeeze=False)[0]):
            axis.hist(values[np.isfinite(values[:, index]), index], bins=40, color=COLORS[0])
            dress(axis, action.names[index] if len(action.names) == action.size else f"action {index}")
            axis.set_yticks([])
    write_aside(out, figure.savefig)
    return out
