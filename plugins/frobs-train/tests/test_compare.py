from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, RunError
from frobs_core.util.files import write_json
from frobs_train import Run, RunConfig, compare, plot_comparison
from frobs_train.comparison.groups import group_runs
from frobs_train.logs.progress import STEPS, ProgressLog


def make(
    path: Path, seed: int, final: float = 1.0, *, rows: int = 20, success: bool = True, total: int = 2000, **config: Any
) -> Run:
    """Write the log of a run whose success climbs evenly to ``final``."""
    settings = {"environment": "X-v0", "steps": total, **config}
    run = Run.create(path, RunConfig(seed=seed, **settings))
    with ProgressLog(path) as log:
        for row in range(1, rows + 1):
            told = final * row / 20
            log.write(
                {
                    STEPS: 100 * row,
                    "time/elapsed": 0.5 * row,
                    "episode/count": 4,
                    "episode/reward": -10.0 + told,
                    "episode/success": told if success else None,
                }
            )
    return run


def evaluated(run: Run, success: float, steps: int = 2000, **changes: Any) -> Run:
    found = {"steps": steps, "episodes": 100, "success_rate": success, "mean_reward": -1.0, "simulator": None}
    write_json(run.path / "evaluations" / f"{steps}_{'-'.join(changes)}.json", {**found, "randomize": None, **changes})
    return run


def test_runs_that_differ_in_nothing_but_the_seed_are_one_group(tmp_path: Path) -> None:
    runs = [make(tmp_path / str(seed), seed, log_every=10 + seed) for seed in range(4)]
    [group] = compare(runs).groups
    assert group.label == "X-v0 · PPO"
    assert [score.seed for score in group.runs] == [0, 1, 2, 3]
    assert group.steps_per_second == 200.0
    assert group.seconds == 10.0


def test_a_label_names_what_differs(tmp_path: Path) -> None:
    slow = make(tmp_path / "a", 0, algorithm_config={"learning_rate": 1e-4, "gamma": 0.9})
    fast = make(tmp_path / "b", 0, algorithm_config={"learning_rate": 1e-3, "gamma": 0.9})
    plain = make(tmp_path / "c", 0, algorithm_config={"gamma": 0.9})
    other = make(tmp_path / "d", 0, algorithm="sac")
    assert list(group_runs([slow, fast, plain, other])) == [
        "X-v0 · PPO · learning_rate=0.0001",
        "X-v0 · PPO · learning_rate=0.001",
        "X-v0 · PPO · learning_rate=default",
        "X-v0 · SAC",
    ]


def test_a_label_names_the_folder_where_too_much_differs(tmp_path: Path) -> None:
    runs = [make(tmp_path / f"run{i}", 0, algorithm_config=dict.fromkeys("abcd", i)) for i in range(2)]
    assert list(group_runs(runs)) == ["X-v0 · PPO · run0", "X-v0 · PPO · run1"]


def test_the_newest_evaluation_as_trained_counts(tmp_path: Path) -> None:
    run = make(tmp_path / "a", 0, final=0.5)
    evaluated(run, 0.2, steps=1000)
    evaluated(run, 0.8, steps=2000)
    evaluated(run, 0.1, steps=2000, simulator="pybullet")
    evaluated(run, 0.1, steps=2000, simulator=None, randomize={"masses": {}})
    evaluated(run, 0.1, steps=2000, deterministic=False)
    [score] = compare([run]).groups[0].runs
    assert (score.final, score.source, score.evaluated_steps) == (0.8, "evaluation", 2000)


def test_evaluations_during_the_training_count_too(tmp_path: Path) -> None:
    run = make(tmp_path / "a", 0)
    with (run.path / "progress.csv").open() as file:
        header, *rows = file.read().splitlines()
    rows = [f"{row},{0.7 if number in (9, 19) else ''}" for number, row in enumerate(rows)]
    (run.path / "progress.csv").write_text("\n".join([f"{header},evaluation/success", *rows, ""]))
    [score] = compare([evaluated(run, 0.2, steps=1000)]).groups[0].runs
    assert (score.final, score.source, score.evaluated_steps) == (0.7, "evaluation", 2000)


def test_without_an_evaluation_the_end_of_the_training_counts_and_that_is_said(tmp_path: Path) -> None:
    plain = make(tmp_path / "a", 0)
    found = compare([evaluated(make(tmp_path / "b", 1), 0.9), plain])
    assert [score.final for score in found.groups[0].runs] == [0.9, pytest.approx(0.975)]
    assert any(f"{plain.path} was not evaluated" in note for note in found.notes)


def test_an_old_evaluation_and_an_unfinished_run_are_said(tmp_path: Path) -> None:
    old = evaluated(make(tmp_path / "a", 0), 0.9, steps=1000)
    cut = make(tmp_path / "b", 1, rows=5)
    found = compare([old, cut])
    assert any("was last evaluated after 1,000 of its 2,000 training steps" in note for note in found.notes)
    assert any("unfinished: 500 of 2,000 steps" in note for note in found.notes)
    assert found.groups[0].curve.steps[-1] == 500


def test_steps_are_counted_to_the_threshold_and_a_run_that_never_gets_there_is_endless(tmp_path: Path) -> None:
    runs = [make(tmp_path / str(seed), seed, final) for seed, final in enumerate((1.0, 1.0, 0.4))]
    [group] = compare(runs, threshold=0.5).groups
    assert (group.steps_to_threshold, group.reached) == (1000, 2)
    [group] = compare(runs[1:], threshold=0.5).groups
    assert (group.steps_to_threshold, group.reached) == (None, 1)
    assert compare(runs[:1]).threshold == 0.95


def test_the_better_group_stands_first_with_its_probability(tmp_path: Path) -> None:
    good = [make(tmp_path / f"good{seed}", seed, 0.9 + 0.01 * seed, num_envs=4) for seed in range(3)]
    bad = [make(tmp_path / f"bad{seed}", seed, 0.3 + 0.01 * seed) for seed in range(3)]
    found = compare([*bad, *good])
    assert [group.label for group in found.groups] == ["X-v0 · PPO · num_envs=4", "X-v0 · PPO · num_envs=8"]
    [improvement] = found.improvements
    assert improvement.first == "X-v0 · PPO · num_envs=4"
    assert improvement.probability.value == 1.0


def test_environments_without_success_are_compared_by_reward(tmp_path: Path) -> None:
    blind = make(tmp_path / "a", 0, success=False)
    found = compare([blind, make(tmp_path / "b", 1)])
    assert found.metric == "reward"
    assert found.threshold is None
    assert any("not reported by 1 of 2 runs" in note for note in found.notes)
    with pytest.raises(RunError, match="--metric reward"):
        compare([blind], metric="success")


def test_environments_are_compared_separately(tmp_path: Path) -> None:
    runs = [
        make(tmp_path / f"{name}{where}{seed}", seed, final, environment=f"{where}-v0", algorithm=name)
        for where in "XY"
        for name, final in (("ppo", 1.0), ("sac", 0.5))
        for seed in range(3)
    ]
    found = compare(runs)
    assert [(group.environment, group.algorithm) for group in found.groups] == [
        *(("X-v0", "ppo"), ("X-v0", "sac"), ("Y-v0", "ppo"), ("Y-v0", "sac"))
    ]
    assert len(found.improvements) == 2
    assert set(found.to_dict()) == {"metric", "threshold", "groups", "improvements", "notes"}  # no average over tasks


def test_given_evaluations_count_instead_of_those_in_the_folder(tmp_path: Path) -> None:
    run = evaluated(make(tmp_path / "a", 0), 0.2, steps=1000)
    found = compare([run], evaluations={run.path: {"steps": 2000, "success_rate": 0.6, "mean_reward": -1.0}})
    [score] = found.groups[0].runs
    assert (score.final, score.source, score.evaluated_steps) == (0.6, "evaluation", 2000)


def test_seeds_and_folders_that_repeat_are_said(tmp_path: Path) -> None:
    run = make(tmp_path / "a", 0)
    notes = compare([run, run, make(tmp_path / "b", 0)]).notes
    assert any("Repeated run folders are ignored" in note for note in notes)
    assert any("same seed" in note for note in notes)


def test_what_cannot_be_compared_is_named(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="pass at least one"):
        compare([])
    with pytest.raises(RunError, match="no rows"):
        compare([make(tmp_path / "empty", 0, rows=0)])
    with pytest.raises(ConfigurationError, match="threshold is nan"):
        compare([make(tmp_path / "a", 0)], threshold=float("nan"))


def test_a_comparison_is_json(tmp_path: Path) -> None:
    found = compare([make(tmp_path / "a", 0)]).to_dict()
    told = json.loads(json.dumps(found, default=str))
    assert told["groups"][0]["final"]["value"] == pytest.approx(0.975)


@pytest.mark.parametrize(
    ("where", "metric"), [("X", "reward"), pytest.param("XYZW", "success", marks=pytest.mark.slow)]
)
def test_a_comparison_is_drawn(where: str, metric: Any, tmp_path: Path) -> None:
    runs = [
        make(tmp_path / f"{name}{seed}", seed, np.random.default_rng(seed).uniform(), environment=f"{name}-v0")
        for name in where
        for seed in range(2)
    ]
    drawn = plot_comparison(compare(runs, metric=metric), tmp_path / "plots" / "comparison.png")
    assert drawn.read_bytes().startswith(b"\x89PNG")
