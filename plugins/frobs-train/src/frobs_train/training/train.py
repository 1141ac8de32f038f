"""Train a policy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from frobs_train.configuration.config import RunConfig, algorithm_record, resolve_algorithm_config
from frobs_train.errors import RunExistsError
from frobs_train.logs.services import make_loggers
from frobs_train.runs.existing_folder import check_existing, resume_existing
from frobs_train.runs.run import Run, default_run_dir
from frobs_train.training.callbacks import build_callbacks
from frobs_train.training.monitor import Progress
from frobs_train.training.seeds import draw_seed
from frobs_train.training.session import prepare_training, run_training


def train(
    config: RunConfig,
    run_dir: Path | str | None = None,
    on_progress: Callable[[Progress], bool | None] | None = None,
    *,
    on_existing: str = "error",
) -> Run:
    """Train a policy, and write one run folder.

    The folder is created after the environments and the algorithm have been built, so that invalid input leaves no
    files behind. In the main thread, Ctrl-C and SIGTERM stop training with a checkpoint at the next point from which
    training can resume exactly. For algorithms that collect rollouts, this point is the end of the current rollout.

    Args:
        config: Configuration from :func:`frobs_train.resolve_config`.
        run_dir: The run folder. Defaults to ``runs/<ID>/<algorithm>_seed<seed>``, or to one with the time.
        on_progress: Called after each row of the log. If this function returns False, training ends with a checkpoint.
        on_existing: How to handle an existing folder. ``"error"`` raises an error, ``"increment"`` writes to
            ``name_2``, ``name_3``, etc., ``"overwrite"`` replaces an existing run, and ``"resume"`` continues an
            existing run with the same configuration.

    Returns:
        The run, with at least one checkpoint.

    Raises:
        RunExistsError: The folder already exists.
        RunBusyError: Another process is training in the folder.
        UnknownNameError: The environment ID or algorithm does not exist.
        ConfigurationError: A setting or keyword argument is invalid, or does not suit the algorithm.
        CheckpointError: A checkpoint cannot be written.
        TrainingError: The environment or the algorithm raised an exception.
        TrainingInterrupt: Ctrl-C or SIGTERM was received.
    """
    path = Path(run_dir) if run_dir is not None else default_run_dir(config)
    check_existing(path, on_existing)
    record = algorithm_record(config.algorithm)
    settings = resolve_algorithm_config(record, config.algorithm_config)
    config = config.model_copy(update={"algorithm_config": settings})
    if on_existing == "resume" and path.exists():
        return resume_existing(path, config, on_progress)
    seed = draw_seed() if config.seed is None else config.seed
    config = config.model_copy(update={"seed": seed})
    prepared = prepare_training(config)
    try:
        callbacks = [*make_loggers(config.log), *build_callbacks(config.callbacks)]
        with Run.begin(path, config, on_existing) as run:
            run_training(run, prepared, callbacks, on_progress)
    except RunExistsError:
        if on_existing != "resume":
            raise
        return resume_existing(path, config, on_progress)  # another process has created the run in the meantime
    finally:
        prepared.env.close()
    return run
