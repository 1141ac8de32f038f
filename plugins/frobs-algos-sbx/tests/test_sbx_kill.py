"""A training run in JAX that is killed at a random moment continues as if it had not been."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

from frobs_train.logs.progress import read_rows

STEPS = 480
CONFIG: dict[str, Any] = {
    "environment": "frobs/Irb120ReachGoal-v0",
    "environment_kwargs": {"num_threads": 1},
    "algorithm": "sbx_sac",
    "num_envs": 4,
    "steps": STEPS,
    "seed": 5,
    "log_every": 8,
    "checkpoint_every": 40,
    "algorithm_config": {
        "buffer_size": 800,
        "batch_size": 8,
        "gradient_steps": 4,
        "normalize_observation": True,
        "learning_rate": "lin_1e-3",
        "policy_kwargs": {"net_arch": [8]},
    },
}


def frobs(*arguments: object) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "frobs_cli", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("config") / "config.yaml"
    path.write_text(yaml.safe_dump(CONFIG))
    return path


@pytest.fixture(scope="module")
def whole(config: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run that was never stopped."""
    path = tmp_path_factory.mktemp("whole") / "run"
    assert frobs("train", CONFIG["environment"], "--config", config, "--run-dir", path).wait() == 0
    return path


def rows(path: Path) -> list[dict[str, str]]:
    found = read_rows(path / "progress.csv")
    return [{key: value for key, value in row.items() if not key.startswith("time/")} for row in found]


def files(path: Path) -> dict[str, bytes]:
    """Return the files of the last checkpoint, but for those that contain times."""
    last = path / "checkpoints" / f"step_{STEPS:09d}"
    timed = ("run.json", "checksums.json")
    found = [file for file in last.rglob("*") if file.is_file() and file.name not in timed]
    return {str(file.relative_to(path)): file.read_bytes() for file in found}


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
def test_a_killed_run_continues_bit_for_bit(number: int, config: Path, whole: Path, tmp_path: Path) -> None:
    draw = random.Random(number)
    path = tmp_path / "run"
    log = path / "progress.csv"
    wanted = draw.randrange(1, len(rows(whole)) - 1)
    process = frobs("train", CONFIG["environment"], "--config", config, "--run-dir", path)
    deadline = time.monotonic() + 120.0
    while not log.is_file() or len(log.read_bytes().splitlines()) <= wanted:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.001)
    time.sleep(draw.uniform(0.0, 0.02))
    process.kill()
    assert process.wait() == -9
    assert frobs("resume", path).wait() == 0
    assert rows(path) == rows(whole)
    assert files(path) == files(whole)
