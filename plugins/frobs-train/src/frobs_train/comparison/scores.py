"""Results of individual runs, read from their evaluations and logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import RunError
from frobs_train.comparison.confidence import band
from frobs_train.logs.progress import STEPS, smooth
from frobs_train.runs.evaluation_files import is_as_trained
from frobs_train.runs.run import Run

CurveSource: TypeAlias = Literal["evaluation", "training"]
"""Values that a learning curve shows: evaluations, or episodes of the training run, in which the policy explores."""

CurveAxis: TypeAlias = Literal["steps", "time"]
"""Quantity on the x axis of a learning curve: environment steps, or the time of training [s]."""

_KEYS = {"success": "success_rate", "reward": "mean_reward"}
_PREFIXES: Mapping[CurveSource, str] = {"evaluation": "evaluation", "training": "episode"}
_AXES: Mapping[CurveAxis, str] = {"steps": STEPS, "time": "time/elapsed"}
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
    stopped: str | None  # why training ended before all steps, or None
    steps_to_threshold: float | None  # read from the learning curve; None if the threshold is never reached
    seconds: float  # training time [s]
    steps_per_second: float


@dataclass(frozen=True, kw_only=True)
class Curve:
    """Learning curve of a metric, with its 95 % interval. All arrays have shape (points,)."""

    x: Floats  # environment steps, or time of training [s]
    middle: Floats
    low: Floats
    high: Floats


def curve_source(logs: Mapping[Path, Columns], metric: str, source: CurveSource | None = None) -> CurveSource:
    """Return what the learning curves of runs show: evaluations if every run has them, unless a source is given.

    Raises RunError if the source is evaluations, but the log of a run has none.
    """
    name = f"evaluation/{metric}"
    without = [path for path, columns in logs.items() if not np.isfinite(columns.get(name, np.array([]))).any()]
    if source == "evaluation" and without:
        raise RunError(
            f"{without[0]} was not evaluated during training; train with evaluate_every, or choose the training curve."
        )
    return source or ("training" if without else "evaluation")


def has_success(run: Run, columns: Columns) -> bool:
    """Return whether the environment of a run reports success."""
    logged = bool(np.isfinite(columns.get("episode/success", np.array([]))).any())
    return logged or any(result.get("success_rate") is not None for result in run.evaluations())


def score_run(
    run: Run,
    columns: Columns,
    metric: str,
    threshold: float | None,
    source: CurveSource,
    found: Mapping[str, Any] | None = None,
) -> RunScore:
    """Return the result of a run, from the fields of an evaluation, the newest evaluation, or else the log.

    If there is a threshold, the result includes the steps at which the learning curve of the source reaches it.
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
    curve_steps, curve = curve_values(columns, curve_column(metric, source))
    reached = curve_steps[curve >= (np.inf if threshold is None else threshold)]
    return RunScore(
        run=run.path,
        seed=run.config.seed,
        final=_last_part(columns, values) if evaluation is None else evaluation[1],
        source="training" if evaluation is None else "evaluation",
        evaluated_steps=None if evaluation is None else evaluation[0],
        steps=int(steps[-1]),
        total_steps=run.config.steps,
        stopped=run.stopped,
        steps_to_threshold=float(reached[0]) if len(reached) else None,
        seconds=seconds,
        steps_per_second=float(steps[-1]) / seconds if seconds > 0 else 0.0,
    )


def curve_of(logs: Sequence[Columns], metric: str, source: CurveSource, over: CurveAxis = "steps") -> Curve:
    """Return the learning curve over all seeds, up to the last point that every seed has reached."""
    known = [
        (x, values) for x, values in (curve_values(log, curve_column(metric, source), over) for log in logs) if len(x)
    ]
    if not known:
        nothing = np.array([])
        return Curve(x=nothing, middle=nothing, low=nothing, high=nothing)
    start, end = max(x[0] for x, _ in known), min(x[-1] for x, _ in known)
    grid = np.linspace(min(start, end), end, _POINTS)
    middle, low, high = band(np.stack([np.interp(grid, x, values) for x, values in known]))
    return Curve(x=grid, middle=middle, low=low, high=high)


def curve_column(metric: str, source: CurveSource) -> str:
    """Return the name of the column with the values of a learning curve."""
    return f"{_PREFIXES[source]}/{metric}"


def curve_values(columns: Columns, name: str, over: CurveAxis = "steps") -> tuple[Floats, Floats]:
    """Return a learning curve of one run, a column of its log: x and y, (points,) each. Smooth values of training."""
    missing = np.full(len(columns[STEPS]), np.nan)
    x, values = columns.get(_AXES[over], missing), columns.get(name, missing)
    if not name.startswith("evaluation/"):
        values = smooth(values, columns.get("episode/count", np.ones(len(values))))
    known = np.isfinite(values) & np.isfinite(x)
    return x[known], values[known]


def _newest_evaluation(run: Run, columns: Columns, metric: str) -> tuple[int, float] | None:
    """Return the steps and the result of the newest evaluation, or None if there is no evaluation.

    Only deterministic evaluations with the training run's simulator and the nominal models are considered. Among
    evaluations of the same policy, the one with the most episodes counts, or else the first one. The result has no
    influence on the choice, which would otherwise prefer lucky seeds.
    """
    key = _KEYS[metric]
    results = [
        (int(result["steps"]), int(result["episodes"]), float(result[key]))
        for result in run.evaluations()
        if result.get(key) is not None and is_as_trained(result)
    ]
    values = columns.get(f"evaluation/{metric}", np.array([]))
    results += [(int(columns[STEPS][row]), 0, float(values[row])) for row in np.flatnonzero(np.isfinite(values))]
    if not results:
        return None
    steps, _, value = max(results, key=lambda result: result[:2])
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
