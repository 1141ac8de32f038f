"""Training."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym

from frobs_core.errors import ConfigurationError, RunExistsError
from frobs_core.runs.config import RunConfig, algorithm_record, resolve_algorithm_config
from frobs_core.runs.environments import make_vector_env
from frobs_core.runs.monitor import EpisodeStatistics, Progress, RunMonitor
from frobs_core.runs.progress import ProgressLog
from frobs_core.runs.recorder import EpisodeRecorder
from frobs_core.runs.run import Run, default_run_dir
from frobs_core.runs.seeds import draw_seed, spread_seed
from frobs_core.specs import AlgorithmRecord


def train(
    config: RunConfig,
    run_dir: Path | str | None = None,
    on_progress: Callable[[Progress], bool | None] | None = None,
) -> Run:
    """Train, and write one folder.

    The folder is made once everything else stands, so that bad input leaves nothing behind.

    Args:
        config: See :func:`frobs_core.runs.resolve_config`.
        run_dir: The folder; None: ``runs/<ID>/<algorithm>_seed<seed>``, or with the time where no seed was chosen.
        on_progress: Called after each iteration; where it returns False, the training ends with a checkpoint.

    Returns:
        The run, with at least one checkpoint.

    Raises:
        RunExistsError: The folder exists.
        UnknownNameError: No such environment ID or algorithm.
        ConfigurationError: A setting or keyword cannot be used, or the algorithm cannot act in the environment.
        CheckpointError: A checkpoint cannot be written.
    """
    path = Path(run_dir) if run_dir is not None else default_run_dir(config)
    if path.exists():
        raise RunExistsError(path)
    record = algorithm_record(config.algorithm)
    seed = draw_seed() if config.seed is None else config.seed
    settings = resolve_algorithm_config(record, config.algorithm_config)
    config = config.model_copy(update={"seed": seed, "algorithm_config": settings})
    seeds = spread_seed(seed)
    env = make_vector_env(config.environment, config.num_envs, config.keywords())
    try:
        check_action_space(record, config.environment, env.single_action_space)
        env.reset(seed=seeds.environment)
        episodes = EpisodeStatistics()
        recorder = EpisodeRecorder(env, episodes.add)
        algorithm = record.load()(recorder, settings, seeds.algorithm)
        run = Run.create(path, config)
        with ProgressLog(path) as log:
            monitor = RunMonitor(run, recorder, episodes, log, on_progress)
            algorithm.train(config.steps, monitor)
            monitor.write_checkpoint(monitor.steps, algorithm.save)
    finally:
        env.close()
    return run


def check_action_space(record: AlgorithmRecord, environment: str, space: gym.Space[Any]) -> None:
    """Refuse an action space that the algorithm cannot act in.

    Raises:
        ConfigurationError: It cannot.
    """
    if type(space).__name__ not in record.action_spaces:
        raise ConfigurationError(
            f"algorithm '{record.name}' cannot act in {environment}: its action space is {type(space).__name__}, "
            f"and '{record.name}' acts in {', '.join(record.action_spaces)}; choose another algorithm or controller."
        )
