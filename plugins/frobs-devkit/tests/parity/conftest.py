from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from frobs_devkit.parity import Subject, make_subjects

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # where wrong_simulators.py is, for entry points

Compare = Callable[..., Sequence[Subject]]


@pytest.fixture
def subjects(isolated_plugins: Callable[..., object]) -> Compare:
    """MuJoCo and another simulator, which may be one of wrong_simulators.py."""
    isolated_plugins(installed=True, wrong="wrong_simulators")

    def make(other: str = "mujoco", environment: str = "frobs/Irb120Reach-v0", **keywords: object) -> list[Subject]:
        return make_subjects(environment, ["mujoco", other], keywords)

    return make
