"""Training runs and their folders."""

from __future__ import annotations

import logging
import os
import secrets
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Any

from frobs_core.util.errors import CheckpointError, RunError
from frobs_core.util.files import write_json
from frobs_core.util.validation import validate
from frobs_core.util.yaml import load_yaml
from frobs_train.configuration.config import RunConfig
from frobs_train.errors import RunExistsError
from frobs_train.runs.checkpoints import Checkpoint, list_checkpoints, newest_checkpoint
from frobs_train.runs.evaluation_files import list_evaluations, read_evaluation
from frobs_train.runs.history import describe_change, has_history, read_history, write_history
from frobs_train.runs.lock import RunLock
from frobs_train.runs.state import read_best, read_state
from frobs_train.runs.versions import versions
from frobs_train.training.seeds import RunSeeds, draw_seed, spread_seed
from frobs_train.training.threads import decide_threads

_log = logging.getLogger("frobs")


class Run:
    """A training run, which is stored in a run folder.

    ::

        config.yaml      the resolved configuration
        history.json     the same configuration, and its changes
        .lock            ID of the process that is training
        versions.json    versions of Python, the core, the plugins and the libraries
        progress.csv     log of the training run
        tensorboard/     TensorBoard events with the same values as progress.csv
        checkpoints/     checkpoints step_… and best
        wandb.json       ID of the Weights & Biases run, and the steps sent
        mlflow.json      ID of the MLflow run, and the steps sent
        evaluations/     results of `frobs evaluate`, as JSON
        plots/           plot of the learning curves and reward terms
        video.mp4        video of the policy

    Use :meth:`create` or :meth:`open` to obtain an instance.

    Attributes:
        path: The folder.
        config: The resolved configuration that the run uses. The configured seed is never None.
        edited: The configuration in ``config.yaml`` if this file was edited, else None.
        changes: Changes to the configuration since the run began, oldest first. Each change contains the ``steps`` from
            which it applies, the ``time``, and ``settings`` with the old and the new value of each key.
        simulator_kwargs: Settings of the simulator that replace those from training, or None.
    """

    def __init__(self, path: Path, config: RunConfig) -> None:
        self.path = path
        self.config = config
        self.edited: RunConfig | None = None
        self.changes: tuple[Mapping[str, Any], ...] = ()
        self.simulator_kwargs: Mapping[str, Any] | None = None
        self._damaged: set[Path] = set()  # evaluations that were reported

    @classmethod
    def create(cls, path: Path, config: RunConfig) -> Run:
        """Create a new run folder atomically.

        Args:
            path: The folder, which must not exist.
            config: Resolved configuration. If the configured seed is None, a random seed is drawn.

        Raises:
            RunExistsError: The folder already exists.
            RunError: The folder cannot be created.
        """
        with cls.begin(path, config) as run:
            return run

    @classmethod
    @contextmanager
    def begin(cls, path: Path, config: RunConfig, on_existing: str = "error") -> Iterator[Run]:
        """Create a new run folder atomically, and hold its lock inside the ``with`` block.

        The folder is locked before it has its final name. Therefore, no other process can replace or resume a run that
        has begun, and runs that begin at the same time get different folders.

        Args:
            path: The folder.
            config: Resolved configuration. If the configured seed is None, a random seed is drawn.
            on_existing: How to handle an existing folder. ``"increment"`` uses the first free name among ``name_2``,
                ``name_3``, etc., and ``"overwrite"`` replaces an existing run. All other values raise an error.

        Raises:
            RunExistsError: The folder already exists.
            RunBusyError: Another process is training in the folder to replace.
            RunError: The folder cannot be created.
        """
        if config.seed is None:
            config = config.model_copy(update={"seed": draw_seed()})
        aside = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
        try:
            aside.mkdir(parents=True)
        except OSError as error:
            raise RunError(
                f"the run folder {path} cannot be created: {error.strerror}; choose another folder."
            ) from error
        with ExitStack() as stack:
            stack.callback(shutil.rmtree, aside, ignore_errors=True)
            try:
                write_json(aside / "versions.json", {**versions(), "threads": decide_threads(config).to_dict()})
                write_history(aside, config)
                stack.enter_context(RunLock(aside))
                placed = _place(aside, path, on_existing)
            except OSError as error:
                raise RunError(f"the run folder {path} cannot be written: {error}; free some space.") from error
            yield cls(placed, config)

    @classmethod
    def open(cls, path: Path | str) -> Run:
        """Open the run folder ``path``.

        Raises:
            RunError: The folder is not a run folder, or its ``history.json`` is damaged.
            ConfigurationError: The configuration is damaged.
        """
        path = Path(path)
        if not (path / "config.yaml").is_file():
            what = "contains no config.yaml" if path.is_dir() else "is not a folder"
            raise RunError(f"{path} {what}; specify the run folder that 'frobs train' printed.")
        written = validate(RunConfig, load_yaml(path / "config.yaml"), "a run")
        used, changes = read_history(path)
        run = cls(path, written if used is None else used)
        run.changes = changes
        run.edited = written if written != run.config else None
        return run

    @property
    def has_new_algorithm_settings(self) -> bool:
        """Whether algorithm settings have changed since the run began, as in population-based training."""
        return any(key.startswith("algorithm_config.") for change in self.changes for key in change["settings"])

    @property
    def seeds(self) -> RunSeeds:
        """Seeds that are derived from the run's seed."""
        assert self.config.seed is not None
        return spread_seed(self.config.seed)

    @property
    def checkpoints(self) -> list[Checkpoint]:
        """Complete checkpoints, oldest first."""
        return list_checkpoints(self.path / "checkpoints")

    @property
    def stopped(self) -> str | None:
        """Reason why training ended before all steps, or None if it can continue or the newest checkpoint is damaged."""
        try:
            return next((read_state(each.path)[0].stopped for each in self.checkpoints[-1:]), None)
        except CheckpointError:
            return None

    def newest_checkpoint(self) -> tuple[Checkpoint, list[str]]:
        """Return the newest undamaged checkpoint, and one message for each newer checkpoint that is damaged.

        Raises:
            CheckpointError: There is no undamaged checkpoint.
        """
        return newest_checkpoint(self.path / "checkpoints")

    def find_checkpoint(self, which: str | int = "newest") -> tuple[Checkpoint, list[str]]:
        """Return a checkpoint for prediction, and one message for each newer checkpoint that is damaged.

        Args:
            which: Checkpoint to return: ``"newest"`` for the newest undamaged checkpoint, ``"best"`` according to
                evaluations during training, or a number of environment steps.

        Raises:
            CheckpointError: The checkpoint does not exist or is damaged.
        """
        if which == "newest":
            return self.newest_checkpoint()
        by_name = {str(item.steps): item for item in self.checkpoints}
        best = self.path / "checkpoints" / "best"
        if (best / "checksums.json").is_file():
            by_name["best"] = Checkpoint(best, read_best(best)[0])
        chosen = by_name.get(str(which))
        if chosen is None:
            raise CheckpointError(f"{self.path} has no checkpoint '{which}'. Available: newest, {', '.join(by_name)}.")
        chosen.verify()
        return chosen, []

    def record(self, before: RunConfig, steps: int) -> None:
        """Write the configuration, and record any change together with the number of environment steps.

        Raises:
            RunError: A file cannot be written.
        """
        if self.config != before:
            self.changes = (*self.changes, describe_change(before, self.config, steps))
        elif self.edited is None and has_history(self.path):
            return
        try:
            write_history(self.path, self.config, self.changes)
        except OSError as error:
            raise RunError(
                f"the configuration of {self.path} cannot be written: {error.strerror}; free some space, or make the "
                "folder writable."
            ) from error
        self.edited = None

    def evaluations(self) -> list[dict[str, Any]]:
        """Return the evaluation results in ``evaluations/``, ordered by file name.

        Damaged files are ignored, and each is reported once.

        Raises:
            RunError: There are more files than the limit.
        """
        results = []
        for path in list_evaluations(self.path):
            try:
                results.append(read_evaluation(path))
            except RunError as error:
                if path not in self._damaged:
                    _log.warning("%s This evaluation is ignored; remove the file.", error)
                self._damaged.add(path)
        return results

    def output(self, *names: str) -> Path:
        """Return the path of a file to write in the run folder. The parts of the path are ``names``.

        Raises:
            RunError: A symbolic link in the run folder would lead the write to another folder.
        """
        target = self.path.joinpath(*names)
        for path in (target.parent, target):
            real = Path(os.path.realpath(path))  # unlike Path.resolve(), also of a link to itself
            if not real.is_relative_to(os.path.realpath(self.path)):
                raise RunError(
                    f"{target} is not written, because {path} is a link to {real}, outside of the run folder; remove the "
                    "link, or choose another file."
                )
        return target


def _place(aside: Path, path: Path, on_existing: str) -> Path:
    target, numbers = path, count(2)
    while not _rename(aside, target):
        if on_existing == "increment":
            target = path.with_name(f"{path.name}_{next(numbers)}")
        elif on_existing == "overwrite" and _is_replaceable(path):
            discard_run(path)
        else:
            raise RunExistsError(path)
    return target


def _is_replaceable(path: Path) -> bool:
    """Return whether a folder is a run, or another process has removed or replaced it in the meantime."""
    before = _identity(path)
    return before is None or is_run(path) or _identity(path) != before


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except FileNotFoundError:
        return None
    return status.st_dev, status.st_ino


def _rename(aside: Path, target: Path) -> bool:
    if target.exists():  # renaming would replace an empty folder
        return False
    try:
        os.rename(aside, target)
    except OSError:
        if target.exists():  # another process created the folder first
            return False
        raise
    return True


def discard_run(path: Path) -> None:
    """Remove a run folder that may already have been removed."""
    old = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
    try:
        with RunLock(path):
            os.replace(path, old)
    except RunError as error:
        if not isinstance(error.__cause__, FileNotFoundError):
            raise
    shutil.rmtree(old, ignore_errors=True)


def is_run(path: Path) -> bool:
    """Return whether a folder is a run folder."""
    return (path / "config.yaml").is_file() and (path / "versions.json").is_file()


def find_runs(paths: Iterable[Path | str]) -> list[Run]:
    """Open run folders, and all run folders below other folders, in the order of their paths.

    Raises:
        RunError: A path is not a folder, or a folder contains no run.
    """
    found = []
    for path in map(Path, paths):
        below = () if is_run(path) else {file.parent for file in path.rglob("config.yaml")}
        # A hidden folder is a run that is being created or removed.
        inside = sorted(each for each in below if is_run(each) and not each.name.startswith("."))
        found += [Run.open(each) for each in inside or (path,)]
    return found


def default_run_dir(config: RunConfig) -> Path:
    """Return ``runs/<ID>/<algorithm>_seed<seed>``, or a name with the current time if the seed is None."""
    ending = datetime.now().strftime("%Y%m%d-%H%M%S") if config.seed is None else f"seed{config.seed}"
    return Path("runs") / config.environment.rpartition(":")[2] / f"{config.algorithm}_{ending}"
