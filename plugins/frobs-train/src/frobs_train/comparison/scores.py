"""Results of individual runs, read from their evaluations and logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import RunError
from frobs_train.comparison.confidence import band
from frobs_train.logs.progress import STEPS, smooth
from frobs_train.runs.run import Run

_KEYS = {"success": "success_rate", "reward": "mean_reward"}
_LAST_PART = 0.1
_POINTS = 200

Columns = Mapping[str, Floats]
"""Log of a run: a mapping from column names to arrays of shape (rows,)."""


@dataclass(frozen=True, kw_only=True)
class RunScore:
    """Result of one run. All step counts are in environment steps."""

    run: Path
    seed: int
    final: float  # final value of the metric
    source: Literal["evaluation", "training"]  # origin of ``final``
    evaluated_steps: int | None  # steps at the time of the evaluation, or None if not evaluated
    steps: int
    total_steps: int
    steps_to_threshold: float | None  # based on the smoothed metric; None if the threshold is never reached
    seconds: float  # training time [s]
    steps_per_second: float


@dataclass(frozen=True, kw_only=True)
class Curve:
    """Learning curve of a metric over environment steps, with its 95 % interval. All arrays have shape (points,)."""

    steps: Floats
    middle: Floats
    low: Floats
    high: Floats


def has_success(run: Run, columns: Columns) -> bool:
    """Return whether the environment of a run reports success."""
    logged = bool(np.isfinite(columns.get("episode/success", np.array([]))).any())
    return logged or any(result.get("success_rate") is not None for result in run.evaluations())


def score_run(
    run: Run, columns: Columns, metric: str, threshold: float | None, found: Mapping[str, Any] | None = None
) -> RunScore:
    """Return the result of a run, taken from an evaluation or from the log.

    Args:
        run: The run.
        columns: Log of the run.
        metric: ``"success"`` or ``"reward"``.
        threshold: Target value of the metric, or None. The result includes the number of environment steps that the run
            needs to reach this value.
        found: Fields of the evaluation from which the result is taken. Defaults to the newest evaluation.

    Raises:
        RunError: The run has no evaluation, and no episode has ended yet.
    """
    assert run.config.seed is not None
    if found is None:
        evaluation = _newest_evaluation(run, columns, metric)
    else:
        evaluation = int(found["steps"]), float(found[_KEYS[metric]])
    steps = columns[STEPS]
    values = columns.get(f"episode/{metric}", np.full(len(steps), np.nan))
    if evaluation is None and not np.isfinite(values).any():
        raise RunError(f"{run.path}: no episode has ended yet, so there is no {metric} to compare; try again later.")
    seconds = float(columns.get("time/elapsed", np.zeros(1))[-1])
    return RunScore(
        run=run.path,
        seed=run.config.seed,
        final=_last_part(columns, values) if evaluation is None else evaluation[1],
        source="training" if evaluation is None else "evaluation",
        evaluated_steps=None if evaluation is None else evaluation[0],
        steps=int(steps[-1]),
        total_steps=run.config.steps,
        steps_to_threshold=None if threshold is None else _first_at(columns, values, threshold),
        seconds=seconds,
        steps_per_second=float(steps[-1]) / seconds if seconds > 0 else 0.0,
    )


def curve_of(logs: Sequence[Columns], metric: str) -> Curve:
    """Return the learning curve over all seeds, up to the last step that every seed has reached."""
    smoothed = [_smoothed(columns, metric) for columns in logs]
    known = [(steps, values) for steps, values in smoothed if len(steps)]
    if not known:
        nothing = np.array([])
        return Curve(steps=nothing, middle=nothing, low=nothing, high=nothing)
    start, end = max(steps[0] for steps, _ in known), min(steps[-1] for steps, _ in known)
    grid = np.linspace(min(start, end), end, _POINTS)
    middle, low, high = band(np.stack([np.interp(grid, steps, values) for steps, values in known]))
    return Curve(steps=grid, middle=middle, low=low, high=high)


def _newest_evaluation(run: Run, columns: Columns, metric: str) -> tuple[int, float] | None:
    """Return the steps and the result of the newest evaluation, or None if there is no evaluation.

    Only deterministic evaluations with the training run's simulator and the nominal models are considered.
    """
    key = _KEYS[metric]
    results = [
        (int(result["steps"]), int(result["episodes"]), float(result[key]))
        for result in run.evaluations()
        if result.get(key) is not None
        and not result.get("simulator")
        and not result.get("randomize")
        and result.get("deterministic", True)
    ]
    values = columns.get(f"evaluation/{metric}", np.array([]))
    results += [(int(columns[STEPS][row]), 0, float(values[row])) for row in np.flatnonzero(np.isfinite(values))]
    if not results:
        return None
    steps, _, value = max(results)
    return steps, value


def _last_part(columns: Columns, values: Floats) -> float:
    """Return the mean over the episodes that ended in the last tenth of the steps.

    If no episode ended in the last tenth, return the value of the last row in which an episode ended.
    """
    steps, known = columns[STEPS], np.isfinite(values)
    chosen = known & (steps > (1.0 - _LAST_PART) * steps[-1])
    if not chosen.any():
        chosen[np.flatnonzero(known)[-1]] = True
    weights = np.nan_to_num(columns.get("episode/count", np.ones(len(steps))))[chosen]
    return float(np.average(values[chosen], weights=weights if weights.any() else None))


def _smoothed(columns: Columns, metric: str) -> tuple[Floats, Floats]:
    """Return the step counts and the smoothed values of a metric, omitting log rows without a value."""
    steps = columns[STEPS]
    values = columns.get(f"episode/{metric}", np.full(len(steps), np.nan))
    smoothed = smooth(values, columns.get("episode/count", np.ones(len(steps))))
    known = np.isfinite(smoothed)
    return steps[known], smoothed[known]


def _first_at(columns: Columns, values: Floats, threshold: float) -> float | None:
    smoothed = smooth(values, columns.get("episode/count", np.ones(len(values))))
    above = np.flatnonzero(smoothed >= threshold)
    return float(columns[STEPS][above[0]]) if len(above) else None
