"""Train with one configuration and several seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from frobs_core.util.errors import RunError
from frobs_train.configuration.config import RunConfig, algorithm_record, resolve_algorithm_config
from frobs_train.runners.jobs import training_job
from frobs_train.runners.runner import Outcome, Runner
from frobs_train.runs.existing_folder import check_existing
from frobs_train.runs.run import Run, default_run_dir
from frobs_train.training.monitor import Progress
from frobs_train.training.session import check_environment


def seed_folders(config: RunConfig, seeds: Sequence[int], run_dir: Path | None = None) -> dict[int, Path]:
    """Return the run folder of each seed, which is ``<run_dir>/seed<seed>`` or the default run folder."""
    configs = [config.model_copy(update={"seed": seed}) for seed in seeds]
    return {
        seed: default_run_dir(each) if run_dir is None else run_dir / f"seed{seed}"
        for seed, each in zip(seeds, configs, strict=True)
    }


def train_seeds(
    config: RunConfig,
    seeds: Sequence[int],
    runner: Runner,
    run_dir: Path | None = None,
    on_progress: Callable[[int, Progress], None] | None = None,
    *,
    on_existing: str = "error",
) -> Iterator[Outcome]:
    """Train with one configuration and several seeds.

    Args:
        config: Configuration from :func:`frobs_train.resolve_config`. The configured seed is ignored.
        seeds: The seeds, each in [0, 2³²).
        runner: Runner that executes the training jobs.
        run_dir: Parent folder of the run folders ``seed0``, ``seed1``, …. By default, each run folder is
            ``runs/<ID>/<algorithm>_seed<seed>``.
        on_progress: Called with the index of a seed and the progress of its run.
        on_existing: See :func:`frobs_train.train`. With ``"resume"``, complete runs are not trained again.

    Yields:
        The outcome of each seed as soon as its run has ended. The result of an outcome is a mapping with the keys
        ``run``, ``environment``, ``algorithm``, ``seed``, ``steps``, ``seconds``, ``success``, ``reward`` and
        ``length``.

    Raises:
        RunExistsError: A run folder exists.
        RunError: The parent folder cannot be created.
        ConfigurationError: The configuration is invalid, or the runner cannot run the jobs.
    """
    settings = resolve_algorithm_config(algorithm_record(config.algorithm), config.algorithm_config)
    config = config.model_copy(update={"algorithm_config": settings})
    folders = seed_folders(config, seeds, run_dir)
    for path in folders.values():
        check_existing(path, on_existing)
    check_environment(config)
    if on_existing in ("increment", "overwrite"):  # reserve the folders, in which the jobs then resume the runs
        for seed, path in folders.items():
            with Run.begin(path, config.model_copy(update={"seed": seed}), on_existing) as run:
                folders[seed] = run.path
    root = next(iter(folders.values())).absolute().parent
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(
            f"the folder {root} cannot be created: {error.strerror}; choose another folder with --run-dir."
        ) from error
    jobs = [training_job(config.model_copy(update={"seed": seed}), path) for seed, path in folders.items()]
    yield from runner.run(jobs, root, on_progress)
