from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import transfer_study

PUSH = ["num_envs=2", "steps=300", "algorithm_config.updates=2", "algorithm_config.final_updates=2"]
SHORT = {"reach": ["num_envs=2", "steps=128", "algorithm_config.n_steps=16"], "push": PUSH, "slide": PUSH}


@pytest.mark.slow
@pytest.mark.needs("pybullet")
@pytest.mark.parametrize("case", transfer_study.CASES, ids=lambda case: case.name)
def test_a_policy_of_two_engines_is_evaluated_in_all_settings(case: transfer_study.Case, tmp_path: Path) -> None:
    arguments = (case, "both", 0, 2, SHORT[case.name], tmp_path)
    first = transfer_study.measure(*arguments)
    assert list(first["success"]) == ["mujoco", "mujoco shifted", "pybullet", "pybullet shifted"]
    assert transfer_study.measure(*arguments) == first  # the finished training run is used again


def test_the_page_compares_both_engines_with_each() -> None:
    def rows(*rates: float) -> list[dict[str, object]]:
        names = ("mujoco", "pybullet", "mujoco shifted", "pybullet shifted")
        return [{"success": dict.fromkeys(names, rate), "machine": "a machine", "commit": "abc1234"} for rate in rates]

    found = {("push", "mujoco"): rows(0.5, 0.7), ("push", "pybullet"): rows(0.2, 0.6), ("push", "both"): rows(0.7, 0.9)}
    page = transfer_study.report(found, 250)
    assert "| push | `frobs/PandaPush-v0` | both | 2 | 80.0% (70.0%) | 80.0% (70.0%) | 80.0% (70.0%) |" in page
    assert "| push | mujoco shifted | +20.0 points | **+40.0 points** |" in page
    assert "| reach |" not in page
