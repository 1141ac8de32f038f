"""Plots of searches: how important each setting is, and the value over each setting."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.errors import RunError
from frobs_train.plots.figures import COLORS, FAINT, INK, check_picture, dress, make_figure, save_figure, style
from frobs_train.tuning.study import StudyResult, TrialResult, load_study, quiet

_COLUMNS = 3
_LEAST_TRIALS = 4


def plot_search(found: StudyResult, path: Path | str) -> Path:
    """Plot a search as a PNG, PDF or SVG file: the importance of each setting, and the value of each trial over it.

    The importance is that of PED-ANOVA (Watanabe et al. 2023): how much the settings of the best trials differ from
    those of all trials. Raises RunError if fewer than four trials are complete.
    """
    target = check_picture(path)
    complete = [trial for trial in found.trials if trial.state == "complete" and trial.value is not None]
    if len(complete) < _LEAST_TRIALS:
        raise RunError(
            f"the study has {len(complete)} complete trials, too few for a report, which needs {_LEAST_TRIALS}; continue "
            "it with a larger --trials."
        )
    importance = setting_importance(found)
    keys = sorted(
        {key for trial in complete for key in trial.settings}, key=lambda key: (-importance.get(key, 0.0), key)
    )
    rows = -(-(len(keys) + 1) // _COLUMNS)
    with style() as size:
        figure = make_figure(_COLUMNS * size.panel[0] * 0.8, rows * size.panel[1] * 0.8)
        axes = figure.subplots(rows, _COLUMNS, squeeze=False).flatten()
        dress(axes[0], "importance of each setting")
        axes[0].barh([_short(key) for key in keys], [importance.get(key, 0.0) for key in keys], color=COLORS[0])
        axes[0].invert_yaxis()
        axes[0].set_xlim(0.0, 1.0)
        for axis, key in zip(axes[1:], keys, strict=False):
            _draw_slice(axis, key, complete, found.best)
        for axis in axes[1 + len(keys) :]:
            axis.set_visible(False)
        title = f"{found.name} · {len(complete)} complete trials"
        figure.suptitle(title, x=0.01, ha="left", fontsize="x-large", fontweight="bold", color=INK)
        return save_figure(figure, target)


def setting_importance(found: StudyResult) -> dict[str, float]:
    """Return the importance of each setting in [0, 1], which add up to 1, or nothing if all trials have the same value."""
    import optuna

    values = {trial.value for trial in found.trials if trial.state == "complete"}
    if len(values) < 2:
        return {}
    with quiet():
        evaluator = optuna.importance.PedAnovaImportanceEvaluator()
        return dict(optuna.importance.get_param_importances(load_study(found), evaluator=evaluator))


def _draw_slice(axis: Any, key: str, trials: list[TrialResult], best: TrialResult | None) -> None:
    known = [trial for trial in trials if key in trial.settings]
    given = [trial.settings[key] for trial in known]
    numbers = [value for value in given if isinstance(value, int | float) and not isinstance(value, bool)]
    places: Any = given if len(numbers) == len(given) else [str(value) for value in given]
    dress(axis, _short(key), y_label="value")
    axis.scatter(places, [trial.value for trial in known], s=18, color=COLORS[0], alpha=0.7, linewidth=0)
    for trial, place in zip(known, places, strict=True):
        if best is not None and trial.number == best.number:
            axis.scatter([place], [trial.value], s=70, facecolor="none", edgecolor=FAINT, linewidth=1.5)
    if len(numbers) == len(given) and min(numbers) > 0.0 and max(numbers) / min(numbers) >= np.sqrt(1000.0):
        axis.set_xscale("log")


def _short(key: str) -> str:
    return key.rpartition(".")[2]
