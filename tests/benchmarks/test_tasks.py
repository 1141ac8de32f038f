from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import pretrained
import tasks
from common import manipulation_ids

from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_core.plugins.registry import pretrained_ids, pretrained_path
from frobs_deploy import read_bundle
from frobs_train import resolve_config
from frobs_train.runners.runner import load_runner

REACH = tasks.Case("frobs/Irb120Reach-v0", "ppo")
PUSH = "frobs/PandaPush-v0"


def row(seed: int, success: float, **more: object) -> dict[str, object]:
    found = {
        "success_rate": success,
        "success_interval": [success - 0.01, min(1.0, success + 0.01)],
        "mean_reward": 3.5,
        "mean_length": 50.0,
        "tracking_error": None,
    }
    return {
        "id": REACH.id,
        "algorithm": "ppo",
        "seed": seed,
        "run": "none",
        "steps": 4096,
        "seconds": 30.0 + seed,
        "in_training": success - 0.1,
        "machine": "a machine",
        "commit": "abc1234",
        "mujoco": {**found, **more},
        "pybullet": {**found, "success_rate": success - 0.06},
    }


def test_every_tuned_robot_is_measured_with_what_is_tuned_for_it() -> None:
    found = tasks.cases()
    assert REACH in found
    for case in found:
        tuned = plugins.get_record("algorithm", case.algorithm).tuned  # type: ignore[attr-defined]
        assert case.id in tuned
        assert registry.environments()[case.id][1].robot


def test_the_originals_own_task_stands_beside_ours() -> None:
    ids = [case.id for case in tasks.cases()]
    assert "frobs/Irb120ReachLegacy-v0" in ids
    legacy = tasks.Case("frobs/Irb120ReachLegacy-v0", "ppo")
    page = tasks.report({legacy: [row(0, 0.9)]}, {}, 1000)
    assert "TD3: 82% after 41 h; SAC: 4% after 52 h; PPO: return -548 after 41 h" in page


def test_the_page_shows_the_worst_seed_beside_the_original() -> None:
    rows = {REACH: [row(0, 0.99), row(1, 0.97), row(2, 1.0)]}
    page = tasks.report(rows, {}, 1000)
    [line] = [line for line in page.splitlines() if line.startswith("| [`frobs/Irb120Reach-v0`]")]
    assert (
        "| `ppo` | 3 | 4,096 | 32 s | 97.0% | 96.0% to 98.0% | 99.0% | – | – | ≥ 98% (missed) | 91.0% | 87% |" in line
    )
    assert line.endswith("| TD3: 82% after 41 h |")
    assert "not measured yet: `frobs/Irb120ReachDynamic-v0`" in page
    assert "| 1 | 4,096 | 31 s | 97.0% | 96.0% to 98.0% | – | 3.50 | 50 | 91.0% | abc1234 |" in page


def test_the_page_shows_the_steps_to_success_of_the_seeds_that_measured_them() -> None:
    rows = [
        row(0, 0.99, steps_to_success=21.4),
        row(1, 0.97, steps_to_success=None),
        row(2, 0.98, steps_to_success=30.0),
    ]
    page = tasks.report({REACH: [*rows, row(3, 0.99)]}, {}, 1000)
    assert "| 98.5% | 26 | – | ≥ 98% (missed) |" in page
    assert "| 0 | 4,096 | 30 s | 99.0% | 98.0% to 100.0% | 21 | 3.50 |" in page


def test_the_table_has_the_algorithm_with_the_highest_success_and_says_how_it_learned() -> None:
    imitated, rewarded = tasks.Case(PUSH, "dagger"), tasks.Case(PUSH, "sbx_ppo")
    rows = {imitated: [row(0, 0.99), row(1, 0.98)], rewarded: [row(0, 0.97, steps_to_success=60.2), row(1, 0.96)]}
    page = tasks.report(rows, {}, 1000)
    [line] = [line for line in page.splitlines() if line.startswith(f"| [`{PUSH}`]")]
    assert "| `dagger`, from a scripted expert that sees the state | 2 |" in line
    assert (
        "\n\nAlso measured: `sbx_ppo` ‡. Success: 96.0% to 97.0%, median 96.5%. Seeds: 2. Steps to success: 60. "
        in page
    )
    assert page.count(f"\n## {PUSH}") == 1
    assert list(tasks.best_rows({**rows, rewarded: [row(0, 0.999)]})) == [rewarded]
    assert list(tasks.best_rows({imitated: [], rewarded: [row(0, 0.1)]})) == [rewarded]


def test_the_first_algorithm_is_measured_before_the_best_one_is_chosen(tmp_path: Path) -> None:
    first, second = [case for case in tasks.tuned_cases() if case.id == REACH.id][:2]
    assert first == REACH
    record = tmp_path / "record.json"

    def chosen(*rows: dict[str, object]) -> tasks.Case:
        record.write_text(json.dumps(rows), "utf-8")
        return next(case for case in tasks.cases(record) if case.id == REACH.id)

    other = {**row(0, 0.99), "algorithm": second.algorithm}
    assert chosen(other) == first
    assert chosen(other, row(0, 0.98)) == second
    assert chosen(other, row(0, 0.99)) == first


def test_imitated_manipulation_takes_five_seeds() -> None:
    seeds = {(id, name): len(tasks.Case(id, name).seeds) for id in (PUSH, REACH.id) for name in ("dagger", "ppo")}
    assert seeds == {(PUSH, "dagger"): 5, (PUSH, "ppo"): 3, (REACH.id, "dagger"): 3, (REACH.id, "ppo"): 3}
    assert len(tasks.Case("frobs/PandaPushGoal-v0", "dagger").seeds) == 3


def test_every_manipulation_id_can_have_a_bundle() -> None:
    paths = {id: pretrained.bundle_path(id) for id in manipulation_ids()}
    assert paths["frobs/Ur5PegInsertionTight-v0"].name == "ur5peginsertiontight.frobs"
    assert len({path.parent for path in paths.values()}) == 1
    assert all(pretrained_path(id) == paths[id] for id in pretrained_ids() if id in paths)


def test_the_page_says_why_less_is_left_on_the_other_simulator() -> None:
    rows = {REACH: [row(0, 0.99)]}
    assert tasks.dropped(rows[REACH])
    assert not tasks.dropped([{**row(0, 0.99), "pybullet": None}])
    assert "of that on MuJoCo. Because of the drives." in tasks.report(rows, {REACH.id: "Because of the drives"}, 1000)


def test_a_time_on_a_shared_machine_misses_no_target() -> None:
    slow = {**row(0, 0.99), "seconds": 3600.0}
    for shared, time, wanted in ((True, "60.0 min (shared machine)", "≥ 98%"), (False, "60.0 min", "≥ 98% (missed)")):
        page = tasks.report({REACH: [{**slow, "shared": shared}]}, {}, 1000)
        assert f"| {time} | 99.0% | 98.0% to 100.0% | 99.0% | – | – | {wanted} |" in page


def test_a_tracking_error_is_held_against_its_target() -> None:
    case = tasks.Case("frobs/Irb120ReachDynamic-v0", "ppo")
    for error, verdict in ((0.015, "| 1.5 cm | ≤ 2 cm |"), (0.025, "| 2.5 cm | ≤ 2 cm (missed) |")):
        assert verdict in tasks.report({case: [row(0, 0.9, tracking_error=error)]}, {}, 1000)


def test_what_was_measured_on_another_machine_is_known(tmp_path: Path) -> None:
    record = tmp_path / "record.json"
    rows = [row(0, 0.99), row(2, 0.98)]
    record.write_text(json.dumps(rows), "utf-8")
    assert [tasks.recorded(REACH, seed, record) for seed in (0, 1, 2)] == [rows[0], None, rows[1]]
    assert tasks.recorded(tasks.Case(REACH.id, "sac"), 0, record) is None
    assert tasks.recorded(REACH, 0, tmp_path / "none.json") is None


def test_the_record_that_comes_with_the_source_is_of_what_is_tuned() -> None:
    rows = json.loads(tasks.RECORD.read_text("utf-8"))
    known = {(case.id, case.algorithm) for case in tasks.tuned_cases()}
    assert {(row["id"], row["algorithm"]) for row in rows} <= known
    for found in rows:
        steps = resolve_config(found["id"], flags={"algorithm": found["algorithm"]}).steps
        assert steps <= found["steps"] <= 1.05 * steps, "tuned anew since: measure it again"


@pytest.mark.slow
def test_a_finished_seed_is_not_trained_again_and_becomes_a_bundle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tasks, "PICTURES", tmp_path / "pictures")
    first = tasks.measure(REACH, 3, episodes=4, steps=2048, kept=tmp_path)
    assert first["mujoco"]["episodes"] == 4
    assert "steps_to_success" in first["mujoco"]
    bundle = read_bundle(pretrained.make(REACH, 3, episodes=4, steps=2048, kept=tmp_path))
    training = bundle.manifest["training"]
    assert training["command"] == "frobs train frobs/Irb120Reach-v0 --steps 2048 --seed 3"
    assert [found["simulator"] for found in training["evaluations"]][:1] == [None]
    assert bundle.license == "SPDX-License-Identifier: MIT\n"
    monkeypatch.setattr(tasks, "frobs", None)  # fails if a command runs again
    assert tasks.measure(REACH, 3, episodes=4, steps=2048, kept=tmp_path) == first
    assert tasks.kept_row(REACH, 2, tmp_path) is None
    assert tasks.kept_row(REACH, 3, tmp_path) == first
    tasks.draw(REACH, [first], tmp_path)
    assert "irb120reach-v0.png" in tasks.report({REACH: [first]}, {}, 4)


@pytest.mark.slow
def test_seeds_are_measured_as_jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = [(REACH, 3), (REACH, 4)]
    tasks.measure_as_jobs(load_runner("local"), wanted, 4, 2048, tmp_path, other_simulator=None)
    monkeypatch.setattr(tasks, "frobs", None)  # fails if a command runs again
    first, second = (tasks.measure(*each, episodes=4, steps=2048, kept=tmp_path) for each in wanted)
    assert (first["steps"], first["seed"], first["mujoco"]["episodes"]) == (2048, 3, 4)
    assert first["machine"].endswith("--runner local")
    assert second["run"] == "irb120reach-v0-ppo-seed4/run"
    assert set(first) == set(row(0, 0.9)) | {"shared", "files"}
