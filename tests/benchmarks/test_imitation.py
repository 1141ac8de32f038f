from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import common
import imitation
from person import Person

from frobs_train.environments import make_vector_env
from frobs_train.evaluation.playing import play_episodes
from frobs_train.logs.progress import STEPS

CASES = {(case.name, case.algorithm): case for case in imitation.CASES}


def result(success: float, steps: float | None = 50.0) -> dict[str, Any]:
    return {"success_rate": success, "success_interval": [success, success], "steps_to_success": steps}


def row(**values: object) -> dict[str, Any]:
    return {"seed": 0, "training": 60.0, "shared": False, "machine": "a machine", "commit": "abc1234", **values}


def test_the_page_compares_each_imitation_with_its_demonstrator() -> None:
    person = {"recording": 20.4, "demonstrator": result(0.98, 71.2)}
    rows = [row(**person, **result(0.8, 82.0)), row(**person, **result(0.9, 80.0)), row(**person, **result(0.0, None))]
    page = imitation.report({CASES["recorded-person-20", "act"]: rows})
    assert "| `recorded-person-20` | `act` | 3 | 20 s | 60 s | 0.0% | 80.0% | 81 | 98.0% in 71 steps |" in page
    assert "Machines: a machine. Commits: abc1234." in page
    assert "Not measured yet: `recorded-expert-100` with `bc`, " in page
    assert "upper bounds" not in page


def test_the_page_says_which_seeds_missed_the_success() -> None:
    rows = [row(steps=40_000, best=0.93, **result(0.91)), row(steps=None, best=None, **result(0.4), shared=True)]
    page = imitation.report({CASES["reinforced-alone", "sac"]: rows})
    assert "| `reinforced-alone` | 2 | 40,000, not within 300,000 | 60 s | 93%, – | 40.0% | 65.5% |" in page
    assert "upper bounds" in page


def test_the_page_compares_the_expert_the_clone_and_the_improved_policy() -> None:
    policies = {"expert": result(1.0, 69.0), "clone": result(0.95, 70.0), "improved": result(0.99, 40.0)}
    page = imitation.report({CASES["improved", "ppo"]: [row(cloning=30.0, **policies)]})
    assert "| expert | 1 | – | 100.0% | 100.0% | 69 |" in page
    assert "| clone | 1 | 30 s | 95.0% | 95.0% | 70 |" in page
    assert "| improved | 1 | 60 s | 99.0% | 99.0% | 40 |" in page


def test_without_results_the_page_has_no_tables() -> None:
    page = imitation.report({case: [] for case in imitation.CASES})
    assert "|" not in page
    assert page.count("` with `") == len(imitation.CASES)


def test_the_first_evaluation_that_reaches_the_success_counts() -> None:
    log = {STEPS: [10.0, 20.0, 30.0, 40.0], "evaluation/success": [0.1, math.nan, 0.9, 0.95]}
    assert imitation.first_success(log) == {"steps": 30, "best": 0.95}
    log["evaluation/success"] = [math.nan, 0.2, 0.3, 0.1]
    assert imitation.first_success(log) == {"steps": None, "best": 0.3}


def test_only_missing_seeds_are_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    commands: list[list[str]] = []

    def fake_frobs(*arguments: object, path: Path | None = None) -> dict[str, Any]:
        commands.append([str(word) for word in arguments])
        assert arguments[0] != "record" or path is not None
        return result(0.9)

    monkeypatch.setattr(imitation, "frobs", fake_frobs)
    monkeypatch.setattr(imitation, "KEPT", tmp_path / "kept")
    monkeypatch.setattr(imitation, "BUILD", tmp_path / "build")
    monkeypatch.setattr(imitation, "PAGE", tmp_path / "page.md")
    imitation.main(["--only", "recorded-expert-100", "--seeds", "0", "3"])
    assert [words[0] for words in commands] == ["record", "train", "evaluate", "evaluate"] * 4
    recordings = {words[words.index("--seed") + 1] for words in commands if words[0] == "record"}
    assert recordings == {"0", "3000"}
    assert "| `recorded-expert-100` | `act` | 2 |" in (tmp_path / "page.md").read_text("utf-8")
    assert len(list((tmp_path / "kept").iterdir())) == 4
    commands.clear()
    imitation.main(["--only", "recorded-expert-100", "--seeds", "0", "3"])
    imitation.main(["--kept"])
    assert commands == []
    imitation.main(["--only", "improved", "--seeds", "1"])
    assert [words[0] for words in commands] == ["train", "train", *["evaluate"] * 3]
    assert f"algorithm_config.initial_policy={tmp_path / 'build' / 'improved-ppo-seed1' / 'clone'}" in commands[1]
    imitation.main(["--only", "improved", "--seeds", "1", "--fresh"])
    assert len(commands) == 10


def test_the_settings_of_reinforcement_learning_are_known() -> None:
    from frobs_train import resolve_config

    for id, algorithm, settings in ((imitation.PICK, "sac", imitation.SAC), (imitation.PUSH, "ppo", imitation.PPO)):
        assert resolve_config(id, settings=settings, flags={"algorithm": algorithm}).steps < 8_000_000


def test_a_person_succeeds_more_slowly_than_the_expert() -> None:
    env = make_vector_env(imitation.PICK, 16, {})
    person = Person()
    person.bind(env)
    try:
        counter = play_episodes(env, person, 16, seed=3)
    finally:
        env.close()
    assert np.mean(counter.successes) >= 0.85
    assert np.mean(counter.steps_to_success) > 52.0


@pytest.mark.slow
def test_commands_find_the_policy_that_acts_like_a_person(tmp_path: Path) -> None:
    path = imitation.install_person(tmp_path / "site")
    found = imitation.outcome(imitation.PICK, "--policy", "person", episodes=4, path=path)
    assert set(found) == set(imitation.RESULT)
    assert found["success_rate"] >= 0.5
    checked = common.frobs("check", "policy:person", "--set", f"environment={imitation.PICK}", path=path)
    assert "failed" not in json.dumps(checked)
