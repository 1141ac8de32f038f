"""Every measurement passes where nothing differs, and fails where something was planted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_devkit.parity import TOLERANCES, ActionFile, Measurement, Status, Subject, measure_parity
from frobs_devkit.parity import policy as policy_module
from frobs_devkit.parity.actions import smooth_actions
from frobs_devkit.parity.body_experiments import friction, settling
from frobs_devkit.parity.gravity_drop import gravity_drop
from frobs_devkit.parity.kinematics import forward_kinematics
from frobs_devkit.parity.lidar import lidar
from frobs_devkit.parity.motion import apart
from frobs_devkit.parity.replay import free_steps, play, replay
from frobs_devkit.parity.result import judge, worst
from frobs_devkit.parity.rewards import rewards
from frobs_devkit.parity.step_response import SATURATED_SHARE, saturated_step_response, step_response
from frobs_train import Evaluation

Compare = Callable[..., Sequence[Subject]]

ACTIONS = ActionFile(
    id="frobs/Irb120Reach-v0", seed=3, actions=smooth_actions(gym.spaces.Box(-1.0, 1.0, (6,)), 50, seed=1)
)
MEASUREMENTS: dict[str, Callable[[Sequence[Subject]], Measurement]] = {
    "forward_kinematics": forward_kinematics,
    "step_response": step_response,
    "saturated_step_response": saturated_step_response,
    "gravity_drop": gravity_drop,
    "replay": partial(replay, file=ACTIONS),
    "settling": settling,
    "friction": friction,
    "lidar": lidar,
    "rewards": rewards,
}
PLANTED = [
    ("forward_kinematics", "crooked"),
    ("step_response", "stiff"),
    ("step_response", "heavy"),
    ("step_response", "fine"),
    ("saturated_step_response", "strong"),
    ("saturated_step_response", "fine"),
    ("gravity_drop", "heavy"),
    ("gravity_drop", "fine"),
    ("replay", "stiff"),
    ("replay", "fine"),
    ("settling", "sunk"),
    ("settling", "restless"),
    ("friction", "slippery"),
    ("lidar", "farsighted"),
    ("rewards", "stiff"),
]


def failed(measurement: Measurement) -> list[str]:
    return [comparison.quantity for comparison in measurement.comparisons if comparison.status is Status.FAILED]


@pytest.mark.parametrize("name", MEASUREMENTS)
def test_an_engine_agrees_with_itself_to_the_last_bit(name: str, subjects: Compare) -> None:
    found = MEASUREMENTS[name](subjects())
    assert found.status is Status.PASSED
    against_itself = [c for c in found.comparisons if c.against == "mujoco (1)"]
    assert all(c.error == 0.0 and c.status is Status.PASSED for c in against_itself)
    assert against_itself or name == "forward_kinematics"
    assert found.panels
    assert all(line.x.shape == line.y.shape for panel in found.panels for line in panel.lines)


@pytest.mark.parametrize(("name", "simulator"), PLANTED)
def test_a_planted_difference_is_found(name: str, simulator: str, subjects: Compare) -> None:
    found = MEASUREMENTS[name](subjects(simulator))
    assert found.status is Status.FAILED, [(c.quantity, c.error) for c in found.comparisons]
    assert all(c.simulator == simulator for c in found.comparisons if c.status is Status.FAILED)
    assert all(c.where for c in found.comparisons if c.status is Status.FAILED)


def test_every_measurement_has_a_planted_difference() -> None:
    assert {name for name, _ in PLANTED} == set(MEASUREMENTS)


def test_each_contact_quantity_fails_on_its_own(subjects: Compare) -> None:
    assert failed(settling(subjects("sunk"))) == ["rest height"]
    assert "time to rest" in failed(settling(subjects("restless")))


def test_each_kind_of_friction_fails_on_its_own(subjects: Compare) -> None:
    assert len(failed(friction(subjects("slippery")))) == 3


def test_friction_that_a_simulator_rejects_is_skipped(subjects: Compare) -> None:
    found = friction(subjects("smooth"))
    skipped = [c.reason for c in found.comparisons if c.status is Status.SKIPPED]
    assert skipped == ["smooth rejects the scene"]
    assert failed(found) == []


@pytest.mark.needs("pybullet")
def test_the_rule_that_combines_frictions_is_named(subjects: Compare) -> None:
    facts = friction(subjects("pybullet")).facts
    rules = {key.rpartition(", ")[2]: rule for key, rule in facts.items() if key.startswith("sliding friction of")}
    assert len(rules) == 2
    assert all(rule.endswith("the larger, 0.8") for rule in rules.values())


def test_drives_saturate_in_a_fifth_of_the_samples(subjects: Compare) -> None:
    found = saturated_step_response(subjects())
    share = found.facts["saturated samples, mujoco (1)"]
    each = [float(part.split()[1].rstrip(")")) for part in share.partition("(")[2].split(", ")]
    assert len(each) == 6
    assert min(each) >= 100 * SATURATED_SHARE


def test_without_saturation_no_drive_reaches_a_limit(subjects: Compare) -> None:
    (panel,) = [panel for panel in step_response(subjects()).panels if "Step response" in panel.title]
    for line in panel.lines:
        assert 0.9 < line.y[-1] < 1.05, line.label  # gravity bends the last percents


def test_approximate_drives_may_be_off_by_a_share_of_the_step(subjects: Compare) -> None:
    exact, rough = step_response(subjects("stiff")), step_response(subjects("rough_stiff"))
    assert exact.status is Status.FAILED
    assert rough.status is Status.PASSED
    assert rough.comparisons[0].tolerance == pytest.approx(0.02 * 0.2, rel=0.1)
    assert exact.comparisons[0].tolerance == 1e-6


@pytest.mark.slow
def test_approximate_drives_at_their_limits_may_be_off_by_what_the_step_size_does(subjects: Compare) -> None:
    exact, rough = saturated_step_response(subjects("fine")), saturated_step_response(subjects("rough_fine"))
    assert failed(exact) == ["joint positions", "drive efforts"]
    assert "effect of the step size" not in exact.facts
    assert "The reference mujoco itself has errors of about joint_1" in rough.facts["effect of the step size"]
    joints = rough.comparisons[0]
    assert joints.status is Status.PASSED
    assert joints.tolerance == pytest.approx(2.0 * joints.error)  # the other half is the finer engine's own
    assert joints.tolerance > 0.02 * 0.2


def test_approximate_drives_without_effort_limits_are_found(subjects: Compare) -> None:
    assert failed(saturated_step_response(subjects("rough_boundless"))) == ["joint positions", "drive efforts"]


def test_efforts_may_come_two_steps_early_or_late_and_no_more() -> None:
    expected = np.repeat([1.0, -1.0], 10)
    for late in (-2, -1, 0, 1, 2):
        assert not apart(np.roll(expected, late)[3:-3], expected[3:-3], 2).any()
    assert apart(np.roll(expected, 3)[3:-3], expected[3:-3], 2).max() == 2.0
    assert apart(1.5 * expected, expected, 2).max() == 0.5


def test_what_cannot_be_written_is_skipped(subjects: Compare) -> None:
    found = forward_kinematics(subjects("fixed"))
    (skipped,) = [c for c in found.comparisons if c.status is Status.SKIPPED]
    assert skipped.simulator == "fixed"
    assert "cannot write" in skipped.reason


def test_the_first_simulator_is_the_reference_of_any_number(isolated_plugins: Callable[..., object]) -> None:
    from frobs_devkit.parity import make_subjects

    isolated_plugins(installed=True, wrong="wrong_simulators")
    found = step_response(make_subjects("frobs/Irb120Reach-v0", ["mujoco", "stiff", "mujoco"], {}))
    assert [c.status for c in found.comparisons] == [Status.FAILED] * 2 + [Status.PASSED] * 2
    assert {c.against for c in found.comparisons} == {"mujoco (1)"}
    assert [c.simulator for c in found.comparisons] == ["stiff", "stiff", "mujoco (2)", "mujoco (2)"]


@pytest.mark.slow
def test_a_reward_term_that_stands_still_is_skipped(subjects: Compare) -> None:
    found = rewards(subjects(reward_type="sparse"))
    assert {c.status for c in found.comparisons} <= {Status.SKIPPED, Status.PASSED}
    far = rewards(subjects(goal_low=(-0.5, -0.5, 0.2), goal_high=(-0.3, 0.5, 0.5)))
    assert [c.quantity for c in far.comparisons if c.status is Status.SKIPPED] == ["term precision"]


def test_a_number_that_is_not_one_fails() -> None:
    found = judge("lidar", "ranges", "b", "a", np.array([0.0, np.nan]), exact=True)
    assert found.status is Status.FAILED
    assert worst([judge("lidar", "ranges", "b", "a", 1.0, exact=True), found]) is found


def test_a_share_is_of_how_far_it_goes() -> None:
    assert judge("step_response", "q", "b", "a", 0.003, exact=False, scale=0.2).status is Status.PASSED
    assert judge("step_response", "q", "b", "a", 0.003, exact=False, scale=0.1).status is Status.FAILED
    assert judge("lidar", "q", "b", "a", 0.003, exact=True, scale=1e9).status is Status.FAILED


def test_every_tolerance_has_its_reason() -> None:
    for name, tolerance in TOLERANCES.items():
        assert len(tolerance.reason) > 30, name
        assert 0.0 <= tolerance.exact <= tolerance.approximate < math.inf
        assert tolerance.unit


def fake_evaluation(success: float | None, episodes: int = 200) -> Evaluation:
    return Evaluation(
        success_rate=success,
        success_interval=None if success is None else (max(0.0, success - 0.03), min(1.0, success + 0.03)),
        mean_reward=1.0,
        mean_length=50.0,
        episodes=episodes,
        success_by_octant=None,
        environment="frobs/Irb120Reach-v0",
        simulator="mujoco",
        seed=0,
        deterministic=True,
        randomize=None,
        steps=1000,
    )


@pytest.mark.parametrize(
    ("reference", "other", "status"),
    [
        (1.0, 1.0, Status.PASSED),
        (0.98, 0.94, Status.PASSED),
        (0.98, 0.92, Status.FAILED),
        (0.90, 0.96, Status.FAILED),
        (0.0, 0.0, Status.SKIPPED),
        (None, None, Status.SKIPPED),
    ],
)
def test_a_policy_keeps_its_success_with_fake_evaluations(
    reference: float | None, other: float | None, status: Status, subjects: Compare, monkeypatch: pytest.MonkeyPatch
) -> None:
    rates = {"mujoco": reference, "stiff": other}
    calls: list[Any] = []

    def fake_evaluate(run: Any, episodes: int, *, simulator: str, num_envs: int) -> Evaluation:
        calls.append((episodes, num_envs))
        return fake_evaluation(rates[simulator])

    monkeypatch.setattr(policy_module, "evaluate", fake_evaluate)
    run: Any = SimpleNamespace(path=SimpleNamespace(name="first"))
    found = policy_module.policy(subjects("stiff"), run, 200)
    assert found.status is status
    assert len(set(calls)) == 1  # the same episodes on both
    if status is Status.SKIPPED:
        assert found.comparisons[0].reason


def test_what_follows_a_touch_is_judged_on_its_own(subjects: Compare) -> None:
    actions = np.zeros((25, 6))
    actions[5:, 1] = 1.0  # the arm bows down to the floor
    file = ActionFile(id="frobs/Irb120Reach-v0", seed=0, actions=actions)
    found = {c.quantity: c for c in replay(subjects(), file).comparisons}
    assert list(found) == [
        "joint positions",
        "tool position",
        "joint positions, after a touch",
        "tool position, after a touch",
    ]
    assert found["joint positions"].tolerance == 1e-6
    assert found["joint positions, after a touch"].tolerance > 1e-3
    stiff = replay(subjects("stiff"), file)
    assert "joint positions" in failed(stiff)


def test_a_touch_between_two_actions_is_noticed(subjects: Compare) -> None:
    reference = subjects(controller="tcp_delta_pose")[0]
    with reference.make() as env:
        env.action_space.seed(0)
        actions = [np.array([env.action_space.sample() for _ in range(50)]) for _ in range(3)][2]
    (rollout, still) = play(reference, [(2, actions), (0, np.zeros((4, 6)))])
    upper = reference.placement.model.actuated_joints[4].limits.upper
    assert rollout.joints[:, 4].max() < upper  # whenever somebody looked
    assert 20 < free_steps(reference, rollout) < rollout.steps
    assert free_steps(reference, still) == 4


def test_a_replay_without_a_free_step_is_inconclusive(monkeypatch):
    monkeypatch.setattr("frobs_devkit.parity.replay.free_steps", lambda subject, rollout: 0)
    certificate = measure_parity("frobs/Irb120Reach-v0", ["mujoco", "mujoco"], only=["replay"])
    (measurement,) = certificate.measurements
    first = measurement.comparisons[0]
    assert first.status is Status.SKIPPED
    assert "inconclusive" in first.reason
