"""Makes the environments and the algorithm of a new or resumed training run, and trains."""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium as gym

from frobs_core.contracts import Algorithm
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import IncompatibleSpaceError, NonFiniteValueError, RunError
from frobs_train.configuration.config import RunConfig, algorithm_record
from frobs_train.environments import EnvironmentRecipe, make_vector_env
from frobs_train.errors import EndlessEpisodeError, EnvironmentFaultError, TrainingError
from frobs_train.logs.progress import ProgressLog
from frobs_train.logs.recorder import EpisodeRecorder
from frobs_train.logs.statistics import EpisodeStatistics
from frobs_train.runs.checkpoints import Checkpoint
from frobs_train.runs.run import Run
from frobs_train.runs.state import RunState
from frobs_train.training.callbacks import TrainingCallback
from frobs_train.training.exactness import has_snapshot, why_not_exact
from frobs_train.training.interrupts import Interrupts, TrainingInterrupt
from frobs_train.training.monitor import Progress, RunContext, RunMonitor
from frobs_train.training.periodic_evaluation import TrainingEvaluation
from frobs_train.training.reverse_curriculum import ReverseCurriculum
from frobs_train.training.seeds import spread_seed
from frobs_train.training.threads import decide_threads

_log = logging.getLogger("frobs")


def training_recipe(config: RunConfig) -> EnvironmentRecipe:
    """Return the recipe of a training run's environments, including the number of simulator threads."""
    keywords = config.keywords()
    simulator = decide_threads(config).simulator
    if simulator is not None:
        keywords["num_threads"] = simulator
    if config.stagger:
        keywords["stagger"] = True
    obstacle = "" if config.reset_from is None else "reset_from sets initial states only within one process"
    if isinstance(config.num_envs, dict):
        obstacle = "num_envs runs several simulators, which only one process can do"
    return EnvironmentRecipe(config.environment, keywords, tuple(config.wrappers), obstacle)


def make_training_env(config: RunConfig) -> gym.vector.VectorEnv[Any, Any, Any]:
    """Make the environments of a training run, including the reverse curriculum if it is configured."""
    recipe = training_recipe(config)
    env = make_vector_env(recipe.environment, config.num_envs, recipe.kwargs, recipe.wrappers)
    if config.reset_from is None:
        return env
    try:
        return ReverseCurriculum(env, config.reset_from, config.seed or 0)
    except BaseException:
        env.close()
        raise


def check_action_space(record: AlgorithmRecord, environment: str, space: gym.Space[Any]) -> None:
    """Raise ConfigurationError if the algorithm does not support an action space."""
    if type(space).__name__ not in record.action_spaces:
        raise IncompatibleSpaceError(
            f"algorithm '{record.name}'",
            space,
            f"cannot act in {environment}: the action space is {type(space).__name__}, "
            f"but '{record.name}' supports only {', '.join(record.action_spaces)}; choose another algorithm or controller.",
        )


def check_environment(config: RunConfig) -> None:
    """Raise an error if the environment cannot be made, or if the algorithm does not support its action space."""
    one = dict.fromkeys(config.num_envs, 1) if isinstance(config.num_envs, dict) else 1
    env = make_training_env(config.model_copy(update={"num_envs": one}))
    try:
        check_action_space(algorithm_record(config.algorithm), config.environment, env.single_action_space)
    finally:
        env.close()


@dataclass(frozen=True, kw_only=True)
class PreparedTraining:
    """Environments and algorithm of a training run.

    Attributes:
        env: The seeded environments. The caller must close the environments when the run ends.
        recorder: Wrapper that counts the environments' steps and reports finished episodes.
        episodes: Statistics of the episodes that the recorder reports.
        algorithm: The algorithm, which steps the recorder.
    """

    env: gym.vector.VectorEnv[Any, Any, Any]
    recorder: EpisodeRecorder
    episodes: EpisodeStatistics
    algorithm: Algorithm


def prepare_training(
    config: RunConfig, load: Callable[[EpisodeRecorder, EpisodeStatistics], Algorithm] | None = None
) -> PreparedTraining:
    """Make the environments and the algorithm of a training run.

    Args:
        config: Configuration from :func:`frobs_train.resolve_config`. The seed defaults to 0.
        load: Function that restores environments and statistics and returns an algorithm, instead of a new one.

    Raises:
        UnknownNameError: The environment ID or algorithm does not exist.
        ConfigurationError: A setting or keyword argument is invalid, or does not suit the algorithm.
    """
    record = algorithm_record(config.algorithm)
    settings = record.load().resolve_config(config.algorithm_config)
    seeds = spread_seed(config.seed or 0)
    env = make_training_env(config)
    for wrapper in config.wrappers:
        if wrapper.name.endswith(":NormalizeObservation"):
            _log.warning(
                "The wrapper %s does not keep its statistics, so the policy sees other observations in evaluations than "
                "in training; use algorithm_config.normalize_observation instead.",
                wrapper.name,
            )
    try:
        check_action_space(record, config.environment, env.single_action_space)
        episodes = EpisodeStatistics()
        recorder = EpisodeRecorder(env, episodes.add, training_recipe(config))
        recorder.reset(seed=seeds.environment)
        algorithm = load(recorder, episodes) if load else record.load()(recorder, settings, seeds.algorithm)
        algorithm.check_steps(config.steps)
    except BaseException:
        env.close()
        raise
    return PreparedTraining(env=env, recorder=recorder, episodes=episodes, algorithm=algorithm)


def run_training(
    run: Run,
    prepared: PreparedTraining,
    callbacks: Sequence[TrainingCallback],
    tell: Callable[[Progress], bool | None] | None,
    state: RunState | None = None,
    checkpoint: Checkpoint | None = None,
) -> None:
    """Train for all remaining steps, or until training is stopped. The caller must hold the lock of the run folder.

    The function ``tell`` is called with the progress after each row of the log, and ends training by returning False. A
    resumed run has a state, and the checkpoint from which it is resumed.
    """
    steps = 0 if state is None else state.steps
    env, algorithm = prepared.recorder, prepared.algorithm
    env.steps = steps
    with ExitStack() as stack:
        interrupts = stack.enter_context(Interrupts())
        log = stack.enter_context(ProgressLog(run.path, None if checkpoint is None else steps))
        evaluation = None
        if run.config.evaluate_every is not None:
            evaluation = TrainingEvaluation(run, algorithm, interrupts)
            stack.callback(evaluation.close)
        for callback in callbacks:
            stack.callback(callback.close)
        context = RunContext(
            env=env,
            episodes=prepared.episodes,
            log=log,
            interrupts=interrupts,
            snapshots=has_snapshot(run.config, env),
            exact=why_not_exact(run.config, env.env) is None,
            evaluation=evaluation,
            callbacks=callbacks,
            tell=tell,
        )
        monitor = RunMonitor(run, context, state, checkpoint)
        try:
            for callback in callbacks:
                callback.on_start(run, steps)
            algorithm.train(run.config.steps, monitor)
            monitor.finish(algorithm.save)
        except (NonFiniteValueError, EnvironmentFaultError, EndlessEpisodeError) as error:
            raise TrainingError(run.path, env.steps, str(error).rstrip("."), _resumable(monitor)) from error
        except RunError:
            raise
        except KeyboardInterrupt:
            raise _interrupt(run.path, monitor, interrupts) from None
        except Exception as error:
            raise TrainingError(run.path, env.steps, _cause(error, algorithm), _resumable(monitor)) from error
        monitor.warn_if_endless(finished=True)
        if interrupts.requested is not None:
            raise _interrupt(run.path, monitor, interrupts)
        if monitor.stopped is not None:
            _log.warning("Training ended after %s steps: %s.", f"{monitor.steps:,}", monitor.stopped)
        for callback in callbacks:
            callback.on_end(run, monitor.steps)


def _interrupt(path: Path, monitor: RunMonitor, interrupts: Interrupts) -> TrainingInterrupt:
    import signal

    return TrainingInterrupt(path, _resumable(monitor), interrupts.requested or signal.SIGINT)


def _resumable(monitor: RunMonitor) -> int | None:
    return None if monitor.checkpoint is None else monitor.checkpoint.steps


def _cause(error: Exception, algorithm: Algorithm) -> str:
    """Return a one-line description of an exception and its location, or of a network that has diverged."""
    try:
        with TemporaryDirectory() as folder:
            algorithm.save_policy(Path(folder))
    except NonFiniteValueError as diverged:
        return str(diverged).rstrip(".")
    except Exception as another:
        _log.debug("the policy cannot be saved: %s", another)
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({frames[-1].filename}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {str(error).rstrip('.')}{where}"
