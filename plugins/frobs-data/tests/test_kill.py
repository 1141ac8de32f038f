"""Recordings that are killed."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import made_sets
import numpy as np
import pytest

from frobs_data import Dataset, DatasetWriter, check


@pytest.mark.parametrize("times", [5, pytest.param(20, marks=pytest.mark.slow)])
def test_a_killed_recording_keeps_all_whole_episodes(tmp_path: Path, times: int) -> None:
    folder, rng = tmp_path / "set", random.Random(times)
    known = 0
    for _ in range(times):
        child = subprocess.Popen([sys.executable, made_sets.__file__, folder], stdout=subprocess.PIPE, text=True)
        assert child.stdout is not None
        child.stdout.readline()
        time.sleep(rng.uniform(0.0, 0.5))
        child.kill()
        child.wait()
        child.stdout.close()
        dataset = Dataset(folder)
        count = len(dataset.episodes)
        assert count >= known
        known = count
        for index in range(max(0, count - 2), count):
            given = made_sets.episode(index, 5 + index % 4, 1)
            np.testing.assert_array_equal(dataset.columns(["action"], [index])["action"], given["action"])
            assert (dataset.start_state(index) or {})["time"] == index
            assert len(dataset.pictures(index, made_sets.CAMERAS[0])) == 5 + index % 4
    features = made_sets.features(1)
    with DatasetWriter(folder, made_sets.FPS, features, "arm", codec="libx264", append=True) as writer:
        made_sets.add_episodes(writer, [known], 1)
    assert check(folder) == []
    assert len(Dataset(folder).episodes) == known + 1
    assert not [path for path in folder.rglob("*") if path.is_file() and "chunk-500" in path.parts]
