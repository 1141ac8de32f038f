"""Runs that begin at the same time with the same run folder, as in a job array."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest

from frobs_core.util.errors import RunError
from frobs_train import Run, RunConfig, resume
from frobs_train.errors import RunBusyError, RunExistsError
from frobs_train.runs.run import discard_run

WORKERS = 8


def config(seed: int) -> RunConfig:
    return RunConfig(environment="X-v0", seed=seed)


def begin_at_once(path: Path, on_existing: str) -> list[str]:
    """Begin runs in several threads, which conflict like processes because each opens the lock file itself.

    All runs continue until every thread has begun its run or failed to begin it.
    """
    start, end = Barrier(WORKERS), Barrier(WORKERS)

    def begin(seed: int) -> str:
        start.wait()
        try:
            with Run.begin(path, config(seed), on_existing) as run:
                end.wait()
                assert Run.open(run.path).config.seed == seed
                return run.path.name
        except RunError as error:
            end.wait()
            return type(error).__name__

    with ThreadPoolExecutor(WORKERS) as pool:
        return sorted(pool.map(begin, range(WORKERS)))


def test_with_increment_each_run_gets_its_own_folder(tmp_path: Path) -> None:
    assert begin_at_once(tmp_path / "run", "increment") == ["run", *(f"run_{n}" for n in range(2, WORKERS + 1))]
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("replaced", [False, True])
def test_with_overwrite_no_run_that_has_begun_is_replaced(replaced: bool, tmp_path: Path) -> None:
    if replaced:
        Run.create(tmp_path / "run", config(100))
    assert begin_at_once(tmp_path / "run", "overwrite") == ["RunBusyError"] * (WORKERS - 1) + ["run"]
    assert not list(tmp_path.glob(".*"))


def test_one_run_begins_and_the_others_get_an_error(tmp_path: Path) -> None:
    assert begin_at_once(tmp_path / "run", "error") == ["RunExistsError"] * (WORKERS - 1) + ["run"]


@pytest.mark.parametrize("act", [resume, discard_run])
def test_a_run_is_locked_from_the_moment_that_it_exists(act: Callable[[Path], object], tmp_path: Path) -> None:
    with Run.begin(tmp_path / "run", config(0)) as run, pytest.raises(RunBusyError):
        act(run.path)
    discard_run(run.path)
    discard_run(run.path)  # removing a run that another process has removed has no effect
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_a_run_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    for on_existing in ("error", "overwrite", "resume"):
        with pytest.raises(RunExistsError), Run.begin(tmp_path / "run", config(0), on_existing):
            pass
    assert list(tmp_path.iterdir()) == [tmp_path / "run"]
