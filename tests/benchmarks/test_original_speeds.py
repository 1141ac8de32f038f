from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import originals


@pytest.mark.slow
@pytest.mark.needs("ros", "originals")
def test_steps_of_an_original_environment_are_timed() -> None:
    found = originals.measure("KobukiMazeEnv", "bridge:mujoco", 20)
    assert found["processor"] > 0.0
    assert 0.0 < found["median"] < 1.0
    assert found["rate"] > 1.0
