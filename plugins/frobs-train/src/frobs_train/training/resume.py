"""Resume a training run from its newest checkpoint."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from copy import copy
from functools import partial
from pathlib import Path

from frobs_core.contracts import Algorithm
from frobs_core.util.errors import CheckpointError, ParameterValueError
from frobs_core.util.yaml import merge
from frobs_train.configuration.config import RunConfig, algorithm_record, differences
from frobs_train.configuration.resolve import check_config, read_setting
from frobs_train.environments import check_environment
from frobs_train.logs.recorder import EpisodeRecorder
from frobs_train.logs.services import make_loggers
from frobs_train.logs.statistics import EpisodeStatistics
from frobs_train.runs import checkpoints
from frobs_train.runs.checkpoints import Checkpoint
from frobs_train.runs.history import check_change
from frobs_train.runs.lock import RunLock
from frobs_train.runs.run import Run
from frobs_train.runs.state import RunState, read_arrays, read_state
from frobs_train.runs.versions import changed_versions
from frobs_train.training.callbacks import build_callbacks
from frobs_train.training.exactness import why_not_exact
from frobs_train.training.monitor import Progress
from frobs_train.training.seeds import later_seed
from frobs_train.training.session import prepare_training, run_training

_log = logging.getLogger("frobs")


def resume(
    run: Run | Path | str,
    *,
    steps: int | None = None,
    settings: Sequence[str] = (),
    on_progress: Callable[[Progress], bool | None] | None = None,
) -> Run:
    """Continue a run from its newest undamaged checkpoint, or from the beginning if no checkpoint exists yet.

    If the environment restores its state exactly, the result is identical to the result of an uninterrupted run, with
    the same weights and, except for the times, the same ``progress.csv``. Otherwise, a warning is logged. New episodes
    begin if the checkpoint does not contain the state of the environment.

    Changes to the configuration are logged and recorded in the run's ``history.json``.

    Args:
        run: The run, or its folder.
        steps: Total number of environment steps. Defaults to the configured number. A larger number extends the run and
            changes its configuration. Schedules such as ``lin_3e-4`` then use the new total, so their values increase
            abruptly once.
        settings: Changed settings in the form ``"key=value"``. Only settings of evaluations, logging, checkpoints,
            callbacks, simulator threads and task parameters can change. The same restriction applies to edits of
            ``config.yaml``.
        on_progress: Called after each row of the log. If this function returns False, training ends with a checkpoint.

    Returns:
        The run. A complete run is returned unchanged.

    Raises:
        RunError: The folder is not a writable run folder, or a setting that cannot change has changed.
        RunBusyError: Another process is training in the folder.
        ConfigurationError: ``steps`` is below the number of steps already taken, or a setting is invalid.
        CheckpointError: Checkpoints exist, but none of them is usable.
        TrainingError: The environment or the algorithm raised an exception.
        TrainingInterrupt: Ctrl-C or SIGTERM was received.
    """
    path = run.path if isinstance(run, Run) else Path(run)
    Run.open(path)  # check the folder first, so that no lock file is created in a folder that is not a run
    with RunLock(path):
        run = Run.open(path)
        for name in ("progress.csv", "checkpoints", "tensorboard", "evaluations"):
            run.output(name)  # raises RunError if the training run would write through a link to another folder
        checkpoints.clean(run.path / "checkpoints")
        for debris in run.path.glob(".progress.*.csv"):
            debris.unlink(missing_ok=True)
        config = changed_config(run, steps, settings)
        checkpoint, state = _newest(run)
        done = 0 if state is None else state.steps
        if config.steps < min(done, run.config.steps):
            raise ParameterValueError(
                "steps", config.steps, f"at least {done:,}, the number of steps that {run.path} has already taken"
            )
        stopped = state.stopped if state is not None and steps is None and config == run.config else None
        if stopped is not None or done >= config.steps:
            _log.warning(
                "%s is complete after %s steps%s. To continue training, resume the run with a larger total number of "
                "steps.",
                run.path,
                f"{done:,}",
                "" if stopped is None else f": {stopped}",
            )
            return run
        run, before = copy(run), run.config
        run.config = config
        _continue(run, before, checkpoint, state, on_progress)
    return run


def changed_config(run: Run, steps: int | None = None, settings: Sequence[str] = ()) -> RunConfig:
    """Return the configuration of a resumed run. The arguments have the same meaning as in :func:`resume`."""
    written = run.edited or run.config
    check_change(run.config, written, str(run.path / "config.yaml"))
    given = [read_setting(setting) for setting in settings]
    merged = merge(written.model_dump(), {} if steps is None else {"steps": steps}, *given)
    config = check_config(merged)
    check_change(written, config, "--set")
    if settings:
        for simulator in config.simulators:
            check_environment(config.environment, config.keywords(simulator=simulator))
    return config


def _newest(run: Run) -> tuple[Checkpoint | None, RunState | None]:
    """Return the newest undamaged checkpoint and its run state, which are both None if no checkpoint exists yet."""
    if not run.checkpoints:
        if (run.path / "progress.csv").exists():
            _log.warning("%s has no checkpoint yet, so the run starts from the beginning with the same seed.", run.path)
        return None, None
    checkpoint, damaged = run.newest_checkpoint()
    state, _ = read_state(checkpoint.path)
    for line in damaged:
        _log.warning("%s The run continues from step %s.", line, f"{checkpoint.steps:,}")
    for path in checkpoints.clean(run.path / "checkpoints", beyond=checkpoint.steps):
        _log.warning("The damaged checkpoint is kept as %s; you can remove it at any time.", path)
    return checkpoint, state


def _continue(
    run: Run,
    before: RunConfig,
    checkpoint: Checkpoint | None,
    state: RunState | None,
    on_progress: Callable[[Progress], bool | None] | None,
) -> None:
    for line in changed_versions(run.path / "versions.json") if checkpoint else []:
        _log.warning("%s: the results from here on may differ from those of an uninterrupted run.", line)
    callbacks = [*make_loggers(run.config.log), *build_callbacks(run.config.callbacks)]
    load = None if checkpoint is None else partial(_load, run, checkpoint)
    prepared = prepare_training(run.config, load)
    try:
        steps = 0 if state is None else state.steps
        for key, old, new in differences(before.model_dump(), run.config.model_dump()):
            _log.warning(
                "The setting %s is %s from step %s on; the previous value was %s.", key, new, f"{steps:,}", old
            )
        run.record(before, steps)
        run_training(run, prepared, callbacks, on_progress, state, checkpoint)
    finally:
        prepared.env.close()


def _load(run: Run, checkpoint: Checkpoint, recorder: EpisodeRecorder, episodes: EpisodeStatistics) -> Algorithm:
    """Restore the environments and the statistics, and return the algorithm of a checkpoint."""
    restored = _restore(run, recorder, checkpoint)
    episodes.restore(read_state(checkpoint.path)[1])
    cls: type[Algorithm] = algorithm_record(run.config.algorithm).load()
    folder = checkpoint.path / "algorithm"
    if run.has_new_algorithm_settings:
        algorithm = cls.load_with(folder, recorder, cls.resolve_config(run.config.algorithm_config))
    else:
        algorithm = cls.load(folder, recorder)
    if not restored:
        algorithm.forget_episodes()
    return algorithm


def _restore(run: Run, env: EpisodeRecorder, checkpoint: Checkpoint) -> bool:
    """Restore the environment, and return whether its state was restored.

    Log a warning if the resumed run may differ from an uninterrupted run.
    """
    why = why_not_exact(run.config, env.env)
    if why is not None:
        _log.warning("The resumed run may differ from an uninterrupted run: %s.", why)
    path = checkpoint.path / "environment.npz"
    assert run.config.seed is not None
    seed = later_seed(run.config.seed, checkpoint.steps)
    if not path.is_file():
        env.reset(seed=seed)
        return False
    try:
        env.restore(read_arrays(path))
    except (KeyError, ValueError, IndexError) as error:
        if any(line.startswith("frobs-core was") for line in changed_versions(run.path / "versions.json")):
            _log.warning("The state of the environment was saved by another version of FRobs; new episodes begin.")
            env.reset(seed=seed)
            return False
        raise CheckpointError(
            f"{path} does not fit the environment ({type(error).__name__}: {error}); a plugin may have changed since "
            "the checkpoint was written."
        ) from error
    return True
