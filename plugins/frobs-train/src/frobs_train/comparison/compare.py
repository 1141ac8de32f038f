"""Compare runs across seeds: final results, steps to a threshold, and confidence intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, Literal

import numpy as np

from frobs_core.util.errors import ParameterValueError, RunError
from frobs_train.comparison.confidence import LEAST_RUNS, Estimate, estimate, probability_of_improvement, profile
from frobs_train.comparison.groups import group_runs
from frobs_train.comparison.scores import (
    Curve,
    CurveAxis,
    CurveSource,
    RunScore,
    curve_of,
    curve_source,
    has_success,
    score_run,
)
from frobs_train.logs.progress import read_columns
from frobs_train.runs.run import Run

Metric = Literal["success", "reward"]


@dataclass(frozen=True, kw_only=True)
class Group:
    """Runs that differ only in their seed."""

    label: str  # environment, algorithm and the settings that distinguish the group
    environment: str
    algorithm: str
    runs: tuple[RunScore, ...]
    final: Estimate  # interquartile mean of the final results over seeds
    reached: int  # number of runs that reached the threshold
    steps_to_threshold: float | None  # median over seeds; None if no threshold is set or half of the runs missed it
    seconds: float  # training time [s], median over seeds
    steps_per_second: float  # median over seeds
    curve: Curve

    @property
    def name(self) -> str:
        """The label without the environment."""
        return self.label.removeprefix(f"{self.environment.rpartition(':')[2]} · ")


@dataclass(frozen=True, kw_only=True)
class Aggregate:
    """Success over all environments of the groups with the same name, which have runs in each of them."""

    name: str
    algorithm: str
    environments: int
    runs: int
    final: Estimate  # interquartile mean over all runs, with a bootstrap stratified by environment
    profile: Curve  # fraction of the runs whose success is above x


@dataclass(frozen=True, kw_only=True)
class Improvement:
    """Probability that a run of the first group outperforms a run of the second group. Ties count as one half."""

    first: str  # label of the better group
    second: str
    probability: Estimate


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Result of a comparison.

    Attributes:
        metric: ``"success"`` or ``"reward"``.
        threshold: Target value of the metric, or None. The comparison includes the number of environment steps that
            each run needs to reach this value.
        source: Values that the learning curves show: ``"evaluation"`` or ``"training"``.
        over: Quantity on the x axis of the learning curves: ``"steps"`` or ``"time"`` [s].
        groups: Groups, ordered by environment and then from best to worst.
        improvements: Probability of improvement for each pair of groups in an environment, the better group first.
        aggregates: Results over all environments, best first, if there are several and the metric is success.
        notes: Caveats about the numbers, for example unfinished runs or runs without an evaluation.
    """

    metric: Metric
    threshold: float | None
    source: CurveSource
    over: CurveAxis
    groups: tuple[Group, ...]
    improvements: tuple[Improvement, ...]
    aggregates: tuple[Aggregate, ...]
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as JSON-serializable values, without the learning curves of the groups.

        The data of the learning curves is stored in each run's ``progress.csv``.
        """
        content = asdict(self)
        for group in content["groups"]:
            del group["curve"]
        for aggregate in content["aggregates"]:
            del aggregate["profile"]
        return content


def compare(
    runs: Sequence[Run],
    *,
    metric: Metric | None = None,
    threshold: float | None = None,
    evaluations: Mapping[Path, Mapping[str, Any]] | None = None,
    source: CurveSource | None = None,
    over: CurveAxis = "steps",
) -> Comparison:
    """Compare groups of runs that share environment, algorithm and all settings except the seed.

    The result of a run is taken from its newest evaluation. If there is no evaluation, the result is the mean over the
    last tenth of training. Confidence intervals are 95 % stratified bootstrap intervals with a fixed random seed.
    Environments are compared separately, and all together for groups with runs in each of them.

    Args:
        runs: One or more runs to compare.
        metric: Metric to compare. Defaults to success if every environment reports it, else to reward.
        threshold: Target value of the metric. The comparison includes the number of environment steps that each run
            needs to reach this value. Defaults to 0.95 for success and to no threshold for reward.
        evaluations: Fields of an :class:`frobs_train.Evaluation` to use instead of a run's newest one, by run folder.
        source: What the learning curves show. Defaults to evaluations during training, or if a run has none, to the
            episodes of training, in which the policy explores.
        over: Quantity on the x axis of the learning curves: environment steps, or the time of training [s].

    Raises:
        RunError: No runs are given, a run has no log yet, the metric is success but a run does not report success, or
            the source is evaluations but a run has none.
        ConfigurationError: The threshold is not finite.
    """
    if not runs:
        raise RunError("there is no run to compare; pass at least one run folder.")
    if threshold is not None and not math.isfinite(threshold):
        raise ParameterValueError("threshold", threshold, "finite")
    opened = list({run.path.resolve(): run for run in runs}.values())
    columns = {run.path: read_columns(run.path) for run in opened}
    chosen_evaluations = {path.resolve(): evaluation for path, evaluation in (evaluations or {}).items()}
    blind = [run for run in opened if not has_success(run, columns[run.path])]
    if metric == "success" and blind:
        raise RunError(
            f"the environment of {blind[0].path} does not report success; compare the runs with --metric reward."
        )
    chosen: Metric = metric or ("reward" if blind else "success")
    if threshold is None and chosen == "success":
        threshold = 0.95
    source = curve_source(columns, chosen, source)
    groups = []
    for label, members in group_runs(opened).items():
        scores = tuple(
            score_run(run, columns[run.path], chosen, threshold, source, chosen_evaluations.get(run.path.resolve()))
            for run in members
        )
        curve = curve_of([columns[run.path] for run in members], chosen, source, over)
        groups.append(_group(label, members[0], scores, curve, threshold))
    environments = list(dict.fromkeys(group.environment for group in groups))
    groups.sort(key=lambda group: (environments.index(group.environment), -group.final.value))
    return Comparison(
        metric=chosen,
        threshold=threshold,
        source=source,
        over=over,
        groups=tuple(groups),
        improvements=_improvements(groups),
        aggregates=_aggregates(groups) if chosen == "success" else (),
        notes=tuple(_notes(groups, len(runs) - len(opened), len(blind) if metric is None else 0, len(opened))),
    )


def _group(label: str, run: Run, scores: tuple[RunScore, ...], curve: Curve, threshold: float | None) -> Group:
    soon = [math.inf if score.steps_to_threshold is None else score.steps_to_threshold for score in scores]
    median = float(np.median(soon))
    return Group(
        label=label,
        environment=run.config.environment,
        algorithm=run.config.algorithm,
        runs=scores,
        final=estimate([np.array([score.final for score in scores])]),
        reached=sum(math.isfinite(steps) for steps in soon),
        steps_to_threshold=median if threshold is not None and math.isfinite(median) else None,
        seconds=float(np.median([score.seconds for score in scores])),
        steps_per_second=float(np.median([score.steps_per_second for score in scores])),
        curve=curve,
    )


def _improvements(groups: Sequence[Group]) -> tuple[Improvement, ...]:
    return tuple(
        Improvement(
            first=first.label,
            second=second.label,
            probability=probability_of_improvement(_finals(first), _finals(second)),
        )
        for first, second in combinations(groups, 2)
        if first.environment == second.environment
    )


def _aggregates(groups: Sequence[Group]) -> tuple[Aggregate, ...]:
    environments = {group.environment for group in groups}
    if len(environments) < 2:
        return ()
    named: dict[str, list[Group]] = {}
    for group in groups:
        named.setdefault(group.name, []).append(group)
    thresholds = np.linspace(0.0, 1.0, 101)
    found = []
    for name, members in named.items():
        if len(members) != len(environments):
            continue
        strata = [_finals(group) for group in members]
        middle, low, high = profile(strata, thresholds)
        found.append(
            Aggregate(
                name=name,
                algorithm=members[0].algorithm,
                environments=len(members),
                runs=sum(map(len, strata)),
                final=estimate(strata),
                profile=Curve(x=thresholds, middle=middle, low=low, high=high),
            )
        )
    return tuple(sorted(found, key=lambda aggregate: -aggregate.final.value))


def _finals(group: Group) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([score.final for score in group.runs])


def _notes(groups: Sequence[Group], repeated: int, blind: int, count: int) -> list[str]:
    notes = []
    scores = [score for group in groups for score in group.runs]
    if repeated:
        notes.append(f"Repeated run folders are ignored (number ignored: {repeated}).")
    if 0 < blind < count:
        notes.append(f"Success is not reported by {blind} of {count} runs, so all runs are compared by their reward.")
    for group in groups:
        if len(group.runs) < LEAST_RUNS:
            seeds = f"{len(group.runs)} seed{'s' if len(group.runs) > 1 else ''}"
            notes.append(f"{group.label} has only {seeds}; use at least three seeds before you trust a difference.")
        elif len({score.final for score in group.runs}) == 1:
            notes.append(f"{group.label}: all seeds have the same result, so there is no interval.")
        if len({score.seed for score in group.runs}) < len(group.runs):
            notes.append(f"{group.label}: several runs have the same seed, so they are not independent samples.")
    if any(LEAST_RUNS <= len(group.runs) < 4 for group in groups):
        notes.append("The interquartile mean of three seeds is their mean, and its interval is rough.")
    for score in scores:
        if score.steps < score.total_steps:
            done = f"{score.steps:,} of {score.total_steps:,} steps"
            how = f"ended after {done}: {score.stopped}" if score.stopped else f"is unfinished: {done}"
            notes.append(f"{score.run} {how}.")
    training = [score for score in scores if score.source == "training"]
    if training:
        which = "no run was" if len(training) == len(scores) else f"{_names(training)} not"
        notes.append(
            f"{which} evaluated, so the result is the mean over the last tenth of training, during which the policy "
            "explores; run 'frobs evaluate' to measure the policy without exploration."
        )
    old = [score for score in scores if score.evaluated_steps is not None and score.evaluated_steps < score.steps]
    notes += [
        f"{score.run} was last evaluated after {score.evaluated_steps:,} of its {score.steps:,} training steps."
        for score in old
    ]
    for environment in dict.fromkeys(group.environment for group in groups):
        lengths = sorted(
            {score.total_steps for group in groups if group.environment == environment for score in group.runs}
        )
        if len(lengths) > 1:
            notes.append(f"{environment}: trained for {' and '.join(f'{length:,}' for length in lengths)} steps.")
    return notes


def _names(scores: Sequence[RunScore]) -> str:
    shown = ", ".join(str(score.run) for score in scores[:3])
    more = f" and {len(scores) - 3} more" if len(scores) > 3 else ""
    return f"{shown}{more} {'was' if len(scores) == 1 else 'were'}"
