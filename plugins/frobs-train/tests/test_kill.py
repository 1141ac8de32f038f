"""kill -9, everywhere: what is left can always be continued, and comes to what a run that never stopped comes to."""

from __future__ import annotations

import importlib.util
import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from frobs_train import Run
from frobs_train.logs.progress import STEPS, read_rows

EVERY = 32
CONFIG: dict[str, Any] = {
    "environment": "frobs/Irb120Reach-v0",
    "environment_kwargs": {"num_threads": 1},
    "num_envs": 4,
    "steps": 128,
    "seed": 5,
    "log_every": 1,
    "checkpoint_every": EVERY,
    "keep_checkpoints": 2,
    "evaluate_every": 64,
    "evaluation_episodes": 1,
    "algorithm_config": {
        "n_steps": 4,
        "batch_size": 8,
        "n_epochs": 1,
        "normalize_observation": True,
        "normalize_reward": True,
        "learning_rate": "lin_1e-3",
        "policy_kwargs": {"net_arch": [8]},
    },
}
_spec = importlib.util.spec_from_file_location("fault_injector", Path(__file__).with_name("fault_injector.py"))
assert _spec is not None
assert _spec.loader is not None
fault_injector = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(fault_injector)


@pytest.fixture(scope="module")
def injector() -> Iterator[Any]:
    with fault_injector.FaultInjector() as server:
        yield server


@pytest.fixture(scope="module")
def whole(injector: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """The run that was never stopped, and the calls that it made."""
    path = tmp_path_factory.mktemp("whole") / "run"
    code, calls = injector.run("train", path, CONFIG)
    assert code == 0
    return path, calls


def rows(path: Path) -> list[dict[str, str]]:
    found = read_rows(path / "progress.csv")
    return [{key: value for key, value in row.items() if not key.startswith("time/")} for row in found]


def files(path: Path) -> dict[str, bytes]:
    """Return the last checkpoint and the best; what tells the time is left out."""
    last = path / "checkpoints" / f"step_{CONFIG['steps']:09d}"
    best = path / "checkpoints" / "best"
    found = [file for folder in (last, best) for file in folder.rglob("*") if file.is_file()]
    timed = ("run.json", "checksums.json")
    return {str(file.relative_to(path)): file.read_bytes() for file in found if file.name not in timed}


def check(injector: Any, whole: Path, path: Path, kill: dict[str, int]) -> None:
    code, _ = injector.run("train", path, CONFIG, kill)
    assert code == -9
    newest = max((item.steps for item in Run.open(path).checkpoints), default=0)
    log = path / "progress.csv"
    told = int(float(read_rows(log)[-1][STEPS])) if log.is_file() else 0
    assert newest >= max(told - 1, 0) // EVERY * EVERY  # the one at the last row may have been under way
    code, _ = injector.run("resume", path)
    assert code == 0
    assert rows(path) == rows(whole)
    assert files(path) == files(whole)
    assert not list((path / "checkpoints").glob(".*"))
    lines = (path / "progress.csv").read_text().splitlines()
    assert sum(line.startswith("time/elapsed") for line in lines) == 1


def test_every_phase_of_a_checkpoint_is_met(whole: tuple[Path, list[str]]) -> None:
    names = {call.split()[0] for call in whole[1]}
    assert names >= {"mkdir", "open", "fsync", "replace", "rmtree", "unlink", "rmdir"}
    for file in ("policy.pt", "optimizers.pt", "environment.npz", "run.json", "checksums.json", "best.json"):
        assert any(call == f"open {file}" for call in whole[1]), file


QUICK = ("open environment.npz", "replace .step_", "rmdir")


@pytest.mark.slow
@pytest.mark.parametrize("phase", QUICK)
def test_a_kill_in_a_phase_of_a_checkpoint(
    phase: str, injector: Any, whole: tuple[Path, list[str]], tmp_path: Path
) -> None:
    at = next(index for index, call in enumerate(whole[1]) if call.startswith(phase) and index > len(whole[1]) // 3)
    check(injector, whole[0], tmp_path / "run", {"call": at + 1})


def phases(calls: list[str]) -> list[int]:
    """Return the calls that differ from the one before or behind: of many fsyncs in a row, the first and the last."""
    names = ["", *(re.sub(r"\d+", "", call) for call in calls), ""]
    return [i for i in range(1, len(calls) + 1) if names[i] != names[i - 1] or names[i] != names[i + 1]]


@pytest.mark.slow
@pytest.mark.parametrize("part", range(16))
def test_a_kill_in_every_phase(part: int, injector: Any, whole: tuple[Path, list[str]], tmp_path: Path) -> None:
    found = phases(whole[1])
    half = len(found) // 2  # the second half writes checkpoints and removes old ones, too
    chosen = [*random.Random(0).sample(found[:half], 12), *found[half:]]
    for call in chosen[part::16]:
        check(injector, whole[0], tmp_path / f"run{call}", {"call": call})


@pytest.mark.parametrize("step", [19])
def test_a_kill_in_a_step(step: int, injector: Any, whole: tuple[Path, list[str]], tmp_path: Path) -> None:
    check(injector, whole[0], tmp_path / "run", {"step": step})


@pytest.mark.slow
def test_kills_in_random_steps(injector: Any, whole: tuple[Path, list[str]], tmp_path: Path) -> None:
    # Evaluations step, too: those of the whole run come after.
    for step in random.Random(0).sample(range(1, CONFIG["steps"] // CONFIG["num_envs"]), 20):
        check(injector, whole[0], tmp_path / f"run{step}", {"step": step})
