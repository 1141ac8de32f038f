from __future__ import annotations

import subprocess
import sys

import pytest

from frobs_devkit.testing import Check, CheckFailure, Inconclusive, NotApplicable, check_env, pytest_checks, run_checks


def find(name: str, check: str) -> Check:
    return next(c for c in check_env(f"kit_environments:kit/{name}-v0") if c.name == check)


test_a_sound_environment_passes = pytest_checks(check_env("kit_environments:kit/Point-v0"), allow_inconclusive=False)
test_a_sound_goal_environment_passes = pytest_checks(
    check_env("kit_environments:kit/GoalPoint-v0"), allow_inconclusive=False
)


@pytest.mark.parametrize(
    ("fault", "check", "told"),
    [
        ("Warns", "gymnasium_checker", "Official support for the `seed` function is dropped"),
        ("LargeActions", "stable_baselines3_checker", "symmetric and normalized"),
        ("ClosesOnce", "close_twice", "closed already"),
        ("DependsOnProcess", "fresh_process", "in a fresh process"),
        ("Float64Observation", "spaces_hold", r"float64\[3\], not float32\[3\]"),
        ("LeavesSpace", "spaces_hold", r"is outside its space at the indices \[\[0\]\]"),
        ("NanInInfo", "values_finite", "distance"),
        ("SharedMemory", "observations_share_no_memory", "observations of different steps that share memory"),
        ("SharedBatchMemory", "observations_share_no_memory", "the batch"),
        ("ConstantElement", "observation_elements_vary", r"1 of 3 elements are constant .*\[\[2\]\]"),
        ("ConstantGoal", "observation_elements_vary", "desired_goal"),
        ("FlatGoal", "observation_elements_vary", r"_goal.*1 of 2 elements are constant .*\[\[1\]\]"),
        ("SeedIgnored", "same_seed_repeats", "second environment"),
        ("GlobalRandomState", "same_seed_repeats", "the observation"),
        ("OneStart", "seeds_differ", "seeds 0 and 1 give the same initial observation"),
        ("OneEpisode", "episodes_differ", "episodes 0 and 1"),
        ("KeepsVelocity", "reset_forgets_history", "after a few steps"),
        ("BooleanSuccess", "success_in_every_step", "must be 0.0 or 1.0"),
        ("RareSuccess", "success_in_every_step", "must contain 'is_success' at every step"),
        ("GoalRewardOff", "compute_reward_equals_step", "compute_reward for single goals"),
        ("GoalNotVectorised", "compute_reward_equals_step", "compute_reward for a batch of goals"),
        ("GoalWithoutComputeReward", "compute_reward_equals_step", "needs compute_reward"),
        ("GoalRewardsDistance", "compute_reward_equals_step", "a reached goal has a lower reward"),
        ("FloatPicture", "render_draws", "float64"),
        ("BlackPicture", "render_draws", "single color"),
        ("RenderMoves", "render_draws", "renders at every step"),
        ("SharedState", "same_step_equals_single", "environment"),
        ("LastRowOff", "same_step_equals_single", "environment 6 of 7, step 1"),
        ("SeedsAlike", "same_step_equals_single", "environment 1 of 7, the first observation"),
        ("FinalObservationLost", "same_step_equals_single", "environment"),
        ("TruncationLate", "same_step_equals_single", "environment"),
        ("TruncationLate", "next_step_equals_single", "environment"),
        ("ResetStepCounts", "next_step_equals_single", "in which the environment is reset"),
        ("ResetsAll", "disabled_equals_single", "environment"),
    ],
)
def test_the_kit_catches(fault: str, check: str, told: str) -> None:
    with pytest.raises(CheckFailure, match=told):
        find(fault, check).run()


def test_observations_may_be_unbounded() -> None:
    find("Unbounded", "gymnasium_checker").run()


def test_goals_may_be_constant_in_an_element_that_varies_in_what_is_achieved() -> None:
    find("GoalOnFloor", "observation_elements_vary").run()


SEPARATE = [
    ("Warns", "gymnasium_checker"),
    ("ActionsFromOne", "stable_baselines3_checker"),
    ("Unpicklable", "spec_pickles"),
    ("ClosesOnceWhenNew", "close_twice"),
    ("DependsOnProcess", "fresh_process"),
    ("EndsAreNumbers", "spaces_hold"),
    ("NanInInfo", "values_finite"),
    ("WritesToTheLast", "observations_share_no_memory"),
    ("ConstantElement", "observation_elements_vary"),
    ("TiresLate", "same_seed_repeats"),
    ("FewSeeds", "seeds_differ"),
    ("OneEpisode", "episodes_differ"),
    ("RemembersPushes", "reset_forgets_history"),
    ("RareSuccess", "success_in_every_step"),
    ("GoalRewardsDistance", "compute_reward_equals_step"),
    ("BlackPicture", "render_draws"),
    ("FinalObservationLost", "same_step_equals_single"),
    ("ResetStepCountsInNextStep", "next_step_equals_single"),
    ("ResetsAll", "disabled_equals_single"),
]
"""Faults that one check catches, and no other; for the checks of our own environments, see the file about those."""


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "check"), SEPARATE)
def test_no_other_check_catches(fault: str, check: str) -> None:
    report = run_checks(check_env(f"kit_environments:kit/{fault}-v0"))
    assert [result.name for result in report.failed] == [check]


def test_an_unpicklable_spec_fails() -> None:
    with pytest.raises(Exception, match="pickle"):
        find("Unpicklable", "spec_pickles").run()


def test_what_is_only_ours_does_not_apply_to_others() -> None:
    for name in ("time_advances", "snapshot_continues", "threads_agree", "unknown_keyword_refused"):
        with pytest.raises(NotApplicable):
            find("Point", name).run()


def test_an_id_that_no_other_process_knows_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTHONPATH")
    with pytest.raises(CheckFailure, match="fails in a fresh process: ModuleNotFoundError"):
        find("Point", "fresh_process").run()


def test_a_vector_that_sees_no_episode_end_is_inconclusive(monkeypatch: pytest.MonkeyPatch) -> None:
    from frobs_devkit.testing.environment import vector

    monkeypatch.setattr(vector, "STEPS", 3)
    with pytest.raises(Inconclusive, match="no episode ended"):
        find("Point", "same_step_equals_single").run()


def test_listing_checks_makes_nothing() -> None:
    assert [c.name for c in check_env("no_such_module:no/Such-v0")] == [c.name for c in check_env("CartPole-v1")]


def test_every_check_says_what_it_is() -> None:
    checks = check_env("CartPole-v1")
    assert len({c.name for c in checks}) == len(checks)
    assert all(c.description.endswith(".") for c in checks)


def test_the_kit_does_not_import_pytest() -> None:
    code = "import sys, frobs_devkit.testing; assert not {'pytest', 'mujoco', 'torch'} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_only_changes_once_something_is_achieved_need_not_vary(monkeypatch: pytest.MonkeyPatch) -> None:
    from frobs_core.contracts import Task
    from frobs_tasks_navigation.navigate import Navigate

    (check,) = (c for c in check_env("frobs/KobukiMaze-v0") if c.name == "observation_elements_vary")
    check.run()
    monkeypatch.setattr(Navigate, "late_terms", Task.late_terms)
    with pytest.raises(CheckFailure, match=r"2 of 15 elements are constant .*\[\[5\], \[6\]\]"):
        check.run()
