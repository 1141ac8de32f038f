"""Searches for settings with Ray Tune. The study and run folders have the same format as without Ray."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from ray import tune
from ray.tune.schedulers import (
    ASHAScheduler,
    FIFOScheduler,
    MedianStoppingRule,
    PopulationBasedTraining,
    TrialScheduler,
)

from frobs_core.util.errors import ConfigurationError
from frobs_core.util.files import write_text
from frobs_core.util.plain import plain
from frobs_core.util.yaml import dump_yaml
from frobs_ray.cluster import connect, variables
from frobs_ray.jobs import RETRIES
from frobs_ray.mailbox import open_mailbox
from frobs_ray.nodes import check_nodes, check_resources, flat_versions
from frobs_ray.searcher import Recorder, StudySearcher, StudyTrials
from frobs_ray.trials import Place, run_trial_on_ray
from frobs_train.runners.jobs import estimate_memory
from frobs_train.runs.lock import RunLock
from frobs_train.training.monitor import Progress
from frobs_train.tuning.search import Search
from frobs_train.tuning.search_space import SearchSpace
from frobs_train.tuning.study import REPORTS, StudyResult, TrialResult, quiet
from frobs_train.tuning.tune import Session

if TYPE_CHECKING:
    from frobs_ray.runner import RayRunner

_RESAMPLED = 0.25
"""Probability that population-based training samples a new value for a setting instead of varying the old value."""

_FIXED = ("algorithm_config.policy_kwargs", "algorithm_config.n_steps", "algorithm_config.buffer_size")
"""Settings that affect networks or buffers. Population-based training copies these settings from a better trial without
varying them."""

_QUIET = {
    "TUNE_DISABLE_AUTO_CALLBACK_LOGGERS": "1",
    "TUNE_DISABLE_SIGINT_HANDLER": "1",
    "TUNE_DISABLE_STRICT_METRIC_CHECKING": "1",
    "RAY_AIR_NEW_OUTPUT": "0",
}


def tune_on_ray(
    runner: RayRunner,
    search: Search,
    on_trial: Callable[[StudyResult, TrialResult], None] | None = None,
    on_progress: Callable[[int, int, Progress], None] | None = None,
) -> StudyResult:
    """Run as many trials in parallel as the cluster has resources for, until the study is complete.

    The pruner ``halving`` uses ASHA, ``hyperband`` uses ASHA with several brackets, ``median`` uses the median stopping
    rule, and ``population`` uses population-based training. After an interruption, unfinished trials continue from
    their checkpoints.
    """
    session = Session(search)
    if search.pruner == "population" and search.seeds > 1:
        raise ConfigurationError("population-based training uses one seed per trial; leave out --seeds.")
    with RunLock(session.folder), connect(runner.address), _quiet_tune(), quiet():
        trials = StudyTrials(session)
        if not trials.left:
            return session.result()
        memory = runner.options.memory or estimate_memory(session.base)
        check_resources(runner.processors, memory)
        check_nodes(session.folder)
        mailbox = open_mailbox()
        place = Place(
            search=_portable(session),
            folder=session.folder.absolute(),
            mailbox=mailbox,
            processors=runner.processors,
            expected=flat_versions(),
        )
        trainable = tune.with_resources(
            tune.with_parameters(run_trial_on_ray, place=place), {"cpu": runner.processors, "memory": memory}
        )
        storage = place.folder / "ray"
        tuner = tune.Tuner(
            trainable,
            param_space=_population(trials) if search.pruner == "population" else None,
            tune_config=tune.TuneConfig(
                metric="value",
                mode="max",
                num_samples=1 if search.pruner == "population" else trials.left,
                search_alg=None if search.pruner == "population" else StudySearcher(trials),
                scheduler=_scheduler(session),
                trial_name_creator=_name,
                trial_dirname_creator=_name,
            ),
            run_config=tune.RunConfig(
                name=f"{datetime.now():%Y%m%d-%H%M%S}",
                storage_path=str(storage),
                failure_config=tune.FailureConfig(max_failures=RETRIES),
                callbacks=[Recorder(session, trials, mailbox, on_trial, on_progress)],
                verbose=0,
            ),
        )
        tuner.fit()
        shutil.rmtree(storage, ignore_errors=True)
    return session.result()


def _portable(session: Session) -> Search:
    """Write all settings to a file in the study's folder, and return a search that reads only this file."""
    path = session.folder.absolute() / "base.yaml"
    write_text(path, dump_yaml(plain(session.base.model_dump(), for_yaml=True)))
    return replace(session.search, file=path, flags={}, settings=(), space=None, folder=None, storage=None)


def _name(trial: Any) -> str:
    return str(trial.config["number"])


def _population(trials: StudyTrials) -> dict[str, Any]:
    """Return all members of the population, because Ray's population-based training does not use a searcher."""
    members = list(iter(trials.next, None))
    return tune.grid_search(members)


def _scheduler(session: Session) -> TrialScheduler:
    pruner, longest = session.search.pruner, REPORTS * session.search.seeds
    if pruner == "median":
        return MedianStoppingRule(time_attr="step", grace_period=REPORTS // 4, min_samples_required=5)
    if pruner == "halving":
        return ASHAScheduler(time_attr="step", max_t=longest, grace_period=REPORTS // 4, reduction_factor=2)
    if pruner == "hyperband":
        return ASHAScheduler(time_attr="step", max_t=longest, grace_period=2, reduction_factor=3, brackets=3)
    if pruner == "population":
        return PopulationBasedTraining(
            time_attr="step",
            perturbation_interval=REPORTS // 5,
            custom_explore_fn=partial(_explore, session.space),
            log_config=False,
            require_attrs=False,  # failed trials report only their error, without the required attributes
        )
    return FIFOScheduler()


def _explore(space: SearchSpace, config: Mapping[str, Any]) -> dict[str, Any]:
    """Vary the settings that a trial copies from a better trial."""
    rng, settings = np.random.default_rng(), dict(config["settings"])
    for key, dimension in space.items():
        if key.startswith("algorithm_config.") and not key.startswith(_FIXED):
            anew = rng.random() < _RESAMPLED
            settings[key] = dimension.sample(rng) if anew else dimension.vary(settings[key], rng)
    return {**config, "settings": settings}


@contextmanager
def _quiet_tune() -> Iterator[None]:
    """Prevent Ray Tune from writing event files and messages, and from handling Ctrl-C."""
    with variables(_QUIET), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
