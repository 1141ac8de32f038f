"""Continuing a training from its newest checkpoint."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from frobs_core.errors import CheckpointError, ParameterValueError
from frobs_core.interfaces import Algorithm
from frobs_train.configuration.config import algorithm_record
from frobs_train.logs.recorder import EpisodeRecorder
from frobs_train.logs.statistics import EpisodeStatistics
from frobs_train.runs import checkpoints
from frobs_train.runs.checkpoints import Checkpoint
from frobs_train.runs.lock import RunLock
from frobs_train.runs.run import Run
from frobs_train.runs.state import RunState, read_arrays, read_state
from frobs_train.runs.versions import changed_versions
from frobs_train.training.callbacks import build_callbacks
from frobs_train.training.exactness import why_not_exact
from frobs_train.training.monitor import Progress
from frobs_train.training.seeds import later_seed
from frobs_train.training.session import Start, make_training_env, run_training

_log = logging.getLogger("frobs")


def resume(
    run: Run | Path | str,
    *,
    steps: int | None = None,
    on_progress: Callable[[Progress], bool | None] | None = None,
) -> Run:
    """Continue a run from its newest undamaged checkpoint, or from its beginning where there is none yet.

    Where the environment restores its state exactly, the run goes on as if it had never stopped: same weights, same
    ``progress.csv`` but for the times. Where it does not, its episodes begin anew, and a line of the log says so.

    Args:
        run: The run, or its folder.
        steps: Environment steps in all; None: those of the configuration. More than there extend a run, and its
            configuration with it; schedules such as ``lin_3e-4`` then fall over the new total, so that they rise once.
        on_progress: Called after each row of the log; where it returns False, the training ends with a checkpoint.

    Returns:
        The run. One that is complete is left as it is.

    Raises:
        RunError: The folder is no run, or cannot be written.
        RunBusyError: Another process trains in it.
        ConfigurationError: Fewer steps were asked for than were taken.
        CheckpointError: No checkpoint can be used, though there are some.
        TrainingError: The environment or the algorithm raised.
        TrainingInterrupt: Ctrl-C or SIGTERM came.
    """
    run = run if isinstance(run, Run) else Run.open(run)
    with RunLock(run.path):
        checkpoints.clean(run.path / "checkpoints")
        for debris in run.path.glob(".progress.*.csv"):
            debris.unlink(missing_ok=True)
        checkpoint, state = _newest(run)
        done = 0 if state is None else state.steps
        if steps is not None and steps < min(done, run.config.steps):
            raise ParameterValueError("steps", steps, f"above {done:,}, the number of steps that {run.path} has taken")
        if steps is None and state is not None and state.stopped is not None:
            _log.warning("%s is complete after %s steps: %s. More steps go on.", run.path, f"{done:,}", state.stopped)
            return run
        if done >= (steps or run.config.steps):
            _log.warning("%s is complete: %s steps were taken. More steps go on.", run.path, f"{done:,}")
            return run
        if steps is not None and steps != run.config.steps:
            run = run.extend(steps)
        _continue(run, checkpoint, state, on_progress)
    return run


def _newest(run: Run) -> tuple[Checkpoint | None, RunState | None]:
    """Return the newest undamaged checkpoint and where the run stood; None where nothing was written yet."""
    if not run.checkpoints:
        _log.warning("%s has no checkpoint yet: it begins anew, from its seed.", run.path)
        return None, None
    checkpoint, damaged = run.newest_checkpoint()
    state, _ = read_state(checkpoint.path)
    for line in damaged:
        _log.warning("%s The run continues from step %s.", line, f"{checkpoint.steps:,}")
    for path in checkpoints.clean(run.path / "checkpoints", beyond=checkpoint.steps):
        _log.warning("The damaged checkpoint is kept as %s; remove it when you like.", path)
    return checkpoint, state


def _continue(
    run: Run,
    checkpoint: Checkpoint | None,
    state: RunState | None,
    on_progress: Callable[[Progress], bool | None] | None,
) -> None:
    for line in changed_versions(run.path / "versions.json") if checkpoint else []:
        _log.warning("%s: the numbers to come may differ from those of an uninterrupted run.", line)
    callbacks = build_callbacks(run.config.callbacks)
    env = make_training_env(run.config)
    try:
        env.reset(seed=run.seeds.environment)
        episodes = EpisodeStatistics()
        recorder = EpisodeRecorder(env, episodes.add)
        record = algorithm_record(run.config.algorithm)
        if checkpoint is None or state is None:
            algorithm: Algorithm = record.load()(recorder, run.config.algorithm_config, run.seeds.algorithm)
        else:
            restored = _restore(run, recorder, checkpoint)
            episodes.restore(read_state(checkpoint.path)[1])
            algorithm = record.load().load(checkpoint.path / "algorithm", recorder)
            if not restored:
                algorithm.forget_episodes()
        run_training(run, recorder, episodes, algorithm, Start(state, checkpoint), callbacks, on_progress)
    finally:
        env.close()


def _restore(run: Run, env: EpisodeRecorder, checkpoint: Checkpoint) -> bool:
    """Return the environment to where it was; say it where that is not possible, or not exact."""
    why = why_not_exact(run.config, env.env)
    if why is not None:
        _log.warning("Not an exact continuation: %s.", why)
    path = checkpoint.path / "environment.npz"
    if not path.is_file():
        assert run.config.seed is not None
        env.reset(seed=later_seed(run.config.seed, checkpoint.steps))
        return False
    try:
        env.restore(read_arrays(path))
    except (KeyError, ValueError, IndexError) as error:
        raise CheckpointError(
            f"{path} does not fit the environment, {type(error).__name__}: {error}; a plugin may have changed since."
        ) from error
    return True
