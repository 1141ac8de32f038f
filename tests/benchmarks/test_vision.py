from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import vision

from frobs_train import resolve_config

ROW = {"minutes": 12.0, "shared": False, "seen": 0.99, "black": 0.0, "frozen": 0.01, "another's": 0.0}
ROW |= {"machine": "a machine", "commit": "abc"}


def test_blinded_observations() -> None:
    def seen(step: int) -> dict[str, np.ndarray]:
        pictures = np.full((3, 2, 2, 3), step, np.uint8) + np.arange(3, dtype=np.uint8)[:, None, None, None] * 10
        return {"observation": np.full((3, 4), step, np.float32), "scene": pictures, "wrist": pictures + 100}

    starts = [np.ones(3, bool), np.zeros(3, bool), np.array([False, True, False])]
    kept: dict[str, np.ndarray] = {}
    for step, start in enumerate(starts):
        observation = seen(step)
        dark = vision.black(observation, start, {})
        assert not dark["scene"].any()
        assert not dark["wrist"].any()
        other = vision.others(observation, start, {})
        np.testing.assert_array_equal(other["scene"][1], observation["scene"][0])
        still = vision.frozen(observation, start, kept)
        expected = [0, 2 if step == 2 else 0, 0]
        for env, first in enumerate(expected):
            np.testing.assert_array_equal(still["wrist"][env], seen(first)["wrist"][env])
        for view in (dark, other, still):
            np.testing.assert_array_equal(view["observation"], observation["observation"])
        np.testing.assert_array_equal(observation["scene"], seen(step)["scene"])  # the original stays as it is


@pytest.mark.parametrize("name", vision.CASES)
def test_settings_of_each_case_are_valid(name: str) -> None:
    case = vision.CASES[name]
    config = resolve_config(case.id, file=case.config, check_parts=True)
    assert config.algorithm == "dagger"
    assert bool(config.randomize) == (case.config is not None)


def test_page_names_what_is_missed() -> None:
    page, met = vision.report({("pick", 0): ROW})
    assert met
    assert "| 0 | 12.0 min | 99.0% (98.2 to 99.5) | 0.0% | 1.0% | 0.0% |" in page
    for bad in ({"seen": 0.94}, {"minutes": 21.0}, {"black": 0.3}):
        page, met = vision.report({("pick", 0): ROW | bad})
        assert not met
        assert "(missed: 95% in 20 min)" in page


@pytest.mark.slow
@pytest.mark.needs("rendering")
def test_successes_are_counted() -> None:
    """The expert does not look at pictures."""
    case = vision.CASES["pick"]
    assert vision.successes("expert", case, None, 50) >= 48
    assert vision.successes("expert", case, vision.black, 50) >= 48
    assert vision.successes("random", case, vision.frozen, 50) <= 5
