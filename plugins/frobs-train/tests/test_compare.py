from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, RunError
from frobs_core.util.files import write_json
from frobs_train import Run, RunConfig, compare, find_runs, plot_comparison, write_table
from frobs_train.comparison.confidence import estimate, profile
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


def test_groups_whose_folders_have_the_same_name_are_all_kept(tmp_path: Path) -> None:
    runs = [make(tmp_path / f"{i}" / "seed0", 0, algorithm_config=dict.fromkeys("abcd", i)) for i in range(4)]
    groups = group_runs(runs)
    assert [run for members in groups.values() for run in members] == runs
    assert f"X-v0 · PPO · seed0 ({runs[3].path})" in groups


def test_the_newest_evaluation_as_trained_counts(tmp_path: Path) -> None:
    run = make(tmp_path / "a", 0, final=0.5)
    evaluated(run, 0.2, steps=1000)
    evaluated(run, 0.8, steps=2000)
    evaluated(run, 0.1, steps=2000, simulator="pybullet")
    evaluated(run, 0.1, steps=2000, simulator=None, randomize={"masses": {}})
    evaluated(run, 0.1, steps=2000, deterministic=False)
    [score] = compare([run]).groups[0].runs
    assert (score.final, score.source, score.evaluated_steps) == (0.8, "evaluation", 2000)


def test_among_evaluations_of_one_policy_the_result_does_not_decide(tmp_path: Path) -> None:
    run = evaluated(make(tmp_path / "a", 0), 0.7, deterministic=True)
    evaluated(run, 0.9, seed=1, mean_reward=5.0)
    assert compare([run]).groups[0].final.value == 0.7
    evaluated(run, 0.5, seed=2, episodes=1000)
    assert compare([run]).groups[0].final.value == 0.5
    assert compare([run], metric="reward").groups[0].final.value == -1.0


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
    assert found.groups[0].curve.x[-1] == 500


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
    assert [aggregate.name for aggregate in found.aggregates] == ["PPO", "SAC"]


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


def evaluating(path: Path, seed: int, final: float, **config: Any) -> Run:
    """Write the log of a run that was evaluated during training, better than its exploring episodes."""
    run = Run.create(path, RunConfig(seed=seed, steps=2000, **{"environment": "X-v0", **config}))
    with ProgressLog(path) as log:
        for row in range(1, 11):
            told = {STEPS: 200 * row, "time/elapsed": 30.0 * row, "episode/count": 4}
            told |= {"episode/success": 0.3, "episode/reward": 1.0}
            log.write({**told, "evaluation/success": final * row / 10, "evaluation/reward": 2.0})
    return run


def test_curves_show_evaluations_and_training_only_when_asked(tmp_path: Path) -> None:
    runs = [evaluating(tmp_path / str(seed), seed, 1.0) for seed in range(3)]
    found = compare(runs)
    assert (found.source, found.groups[0].curve.middle[-1]) == ("evaluation", 1.0)
    assert found.groups[0].steps_to_threshold == 2000.0
    asked = compare(runs, source="training")
    assert (asked.source, asked.groups[0].curve.middle[-1]) == ("training", pytest.approx(0.3))
    assert asked.groups[0].steps_to_threshold is None
    assert compare(runs, over="time").groups[0].curve.x[-1] == 300.0
    mixed = [*runs, make(tmp_path / "silent", 3, total=2000)]
    assert compare(mixed).source == "training"
    with pytest.raises(RunError, match="silent was not evaluated during training"):
        compare(mixed, source="evaluation")


def test_few_seeds_and_equal_results_have_no_interval(tmp_path: Path) -> None:
    assert estimate([np.array([0.2, 0.9])]).low is None
    assert estimate([np.array([1.0, 1.0, 1.0, 1.0])]).low is None
    rough = estimate([np.array([0.2, 0.5, 0.8])])
    assert rough.value == pytest.approx(0.5)
    assert rough.low is not None
    runs = [evaluating(tmp_path / str(seed), seed, 1.0) for seed in range(4)]
    assert "X-v0 · PPO: all seeds have the same result, so there is no interval." in compare(runs).notes
    assert "The interquartile mean of three seeds is their mean, and its interval is rough." in compare(runs[:3]).notes


def test_a_profile_is_the_fraction_of_runs_above_each_threshold() -> None:
    strata = [np.array([0.0, 0.5, 1.0]), np.array([0.25, 0.75])]
    middle, low, high = profile(strata, np.array([0.0, 0.5, 1.0]))
    assert middle.tolist() == [0.8, 0.4, 0.0]
    assert ((low <= middle) & (middle <= high)).all()
    assert (low[1], high[1]) != (middle[1], middle[1])


def test_groups_are_aggregated_over_the_environments_that_all_have(tmp_path: Path) -> None:
    runs = [
        evaluating(tmp_path / f"{name}{algorithm}{seed}", seed, final, environment=f"{name}-v0", algorithm=algorithm)
        for name, algorithm, final in (("X", "ppo", 0.5), ("Y", "ppo", 1.0), ("X", "sac", 0.9))
        for seed in range(3)
    ]
    [both] = compare(runs).aggregates
    assert (both.name, both.environments, both.runs, both.final.value) == ("PPO", 2, 6, 0.75)
    assert compare(runs[:3]).aggregates == ()


@pytest.mark.parametrize("ending", [".csv", ".md", ".tex"])
def test_tables_have_all_groups_and_seeds(ending: str, tmp_path: Path) -> None:
    runs = [evaluating(tmp_path / str(seed), seed, 0.1 * seed, environment="a_b:X_y-v0") for seed in range(4, 8)]
    text = write_table(compare(runs), tmp_path / f"table{ending}").read_text("utf-8")
    if ending == ".csv":
        rows = list(csv.DictReader(text.splitlines()))
        assert [row["seed"] for row in rows] == [*map(str, range(4, 8)), "all"]
        assert [float(row["value"]) for row in rows] == pytest.approx([0.4, 0.5, 0.6, 0.7, 0.55])
        assert float(rows[-1]["low"]) < 0.55 < float(rows[-1]["high"])
    elif ending == ".md":
        assert "| X_y-v0 | PPO | 4 | 55.0 % |" in text
        assert "| X_y-v0 | PPO | 7 | 70.0 % | evaluation | 2,000 |" in text
    else:
        assert text.count(r"\begin{tabular}") == text.count(r"\end{tabular}") == 2
        assert r"X\_y-v0 & PPO & 4 & 55.0 \% &" in text
    with pytest.raises(ConfigurationError, match=r"\.csv, \.md or \.tex"):
        write_table(compare(runs), tmp_path / "table.xlsx")


def test_latex_receives_no_special_characters_of_a_label(tmp_path: Path) -> None:
    runs = [make(tmp_path / str(i), 0, algorithm_config={"a": f"~{i}^<2>"}) for i in range(2)]
    text = write_table(compare(runs), tmp_path / "table.tex").read_text("utf-8")
    assert r"a=\textasciitilde{}1\textasciicircum{}\textless{}2\textgreater{} &" in text


def test_a_folder_stands_for_the_runs_in_it(tmp_path: Path) -> None:
    for name in ("a/1", "a/0", "b", ".b.0123456789abcdef"):  # the last one is left over from --on-existing overwrite
        make(tmp_path / "runs" / name, 0)
    found = [run.path.relative_to(tmp_path / "runs").as_posix() for run in find_runs([tmp_path / "runs"])]
    assert found == ["a/0", "a/1", "b"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(RunError, match="empty contains no config"):
        find_runs([tmp_path / "empty"])


@pytest.mark.parametrize(("ending", "begins"), [("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_pictures_for_papers_repeat(ending: str, begins: bytes, tmp_path: Path) -> None:
    runs = [evaluating(tmp_path / str(seed), seed, 0.1 * seed) for seed in range(4, 8)]
    first, second = (plot_comparison(compare(runs), tmp_path / f"{k}.{ending}", size="column") for k in "ab")
    assert first.read_bytes().startswith(begins)
    assert first.read_bytes() == second.read_bytes()
    with pytest.raises(ConfigurationError, match=r"\.png, \.pdf or \.svg"):
        plot_comparison(compare(runs), tmp_path / "picture.gif")
