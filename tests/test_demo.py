"""What ``make demo`` promises, for one seed of each controller: the whole way, as a user goes it."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

FROBS = [sys.executable, "-m", "frobs_cli"]
ID = "frobs/Irb120Reach-v0"


def frobs(*words: object) -> str:
    done = subprocess.run([*FROBS, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def learn(folder: Path, *words: str) -> tuple[dict[str, object], Path]:
    run = folder / "run"
    frobs("train", ID, "--seed", 0, "--run-dir", run, *words)
    return json.loads(frobs("evaluate", run, "--episodes", 1000, "--json")), run


def assert_learned(found: dict[str, object]) -> None:
    assert found["episodes"] == 1000
    assert found["steps"] <= 600_000
    assert found["success_rate"] >= 0.95
    assert min(octant["success_rate"] for octant in found["success_by_octant"].values()) >= 0.85


@pytest.mark.slow
def test_tool_actions_are_learned_and_the_run_folder_is_complete(tmp_path: Path) -> None:
    found, run = learn(tmp_path, "--controller", "tcp_delta_position")
    assert_learned(found)
    frobs("plot", run)
    for pattern in (
        "config.yaml",
        "versions.json",
        "checkpoints/*",
        "tensorboard/*",
        "evaluations/*.json",
        "plots/*.png",
    ):
        assert list(run.glob(pattern)), f"the run folder has no {pattern}"
    rows = list(csv.DictReader((run / "progress.csv").read_text("utf-8").splitlines()))
    assert float(rows[-1]["train/steps"]) >= 40_000
    assert [float(row["episode/success"]) for row in rows if row["episode/success"]][-1] > 0.9


@pytest.mark.slow
def test_joint_actions_are_learned_in_600_000_steps(tmp_path: Path) -> None:
    found, run = learn(tmp_path)
    assert_learned(found)
    video = run / "video.mp4"
    frobs("play", run, "--video", video)
    assert video.stat().st_size > 10_000
    import imageio_ffmpeg

    told = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(video)], capture_output=True, text=True, check=False
    ).stderr
    assert "Video: h264" in told
    assert "yuv420p" in told
