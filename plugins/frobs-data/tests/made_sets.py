"""Small data sets with known content."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from frobs_data import DatasetWriter, Feature

FPS, SIZE = 25, 32
CAMERAS = ("observation.images.front", "observation.images.wrist")
TASKS = ("Lift the cube.", "Push the cube.")


def features(cameras: int = 0) -> dict[str, Feature]:
    return {
        "observation.state": Feature("float32", (3,), ("arm_0", "arm_1", "grip")),
        "action": Feature("float32", (2,), ("x", "y")),
        "next.reward": Feature("float32", (1,)),
        "next.success": Feature("bool", (1,)),
        **{name: Feature("video", (SIZE, SIZE, 3)) for name in CAMERAS[:cameras]},
    }


def episode(number: int, length: int, cameras: int = 0) -> dict[str, Any]:
    rng = np.random.default_rng(number)
    ramp = np.linspace(40, 200, SIZE * SIZE * 3).reshape(SIZE, SIZE, 3)
    return {
        "observation.state": rng.normal(size=(length, 3)).astype(np.float32),
        "action": rng.uniform(-1, 1, (length, 2)).astype(np.float32),
        "next.reward": rng.normal(size=length).astype(np.float32),
        "next.success": np.arange(length) == length - 1,
        **{
            name: np.stack([ramp + 3 * frame + 20 * camera for frame in range(length)]).astype(np.uint8) // 2 + number
            for camera, name in enumerate(CAMERAS[:cameras])
        },
    }


def add_episodes(writer: DatasetWriter, numbers: Sequence[int], cameras: int = 0) -> None:
    for number in numbers:
        state = {"time": np.array([float(number)])}
        writer.add(episode(number, 5 + number % 4, cameras), TASKS[number % 2], state)


def make_set(folder: Path, count: int = 3, cameras: int = 0, **options: Any) -> Path:
    settings = {"environment": "frobs/Test-v0"}
    with DatasetWriter(folder, FPS, features(cameras), "arm", settings, codec="libx264", **options) as writer:
        add_episodes(writer, range(count), cameras)
    return folder


if __name__ == "__main__":  # records until it is killed, and prints the number of each episode that it began
    with DatasetWriter(sys.argv[1], FPS, features(1), "arm", codec="libx264", append=True) as endless:
        for number in range(endless.info.episodes, 10**6):
            add_episodes(endless, [number], 1)
            print(number, flush=True)  # noqa: T201 - read by the test
            if number % 7 == 6:
                endless.close()
                break
