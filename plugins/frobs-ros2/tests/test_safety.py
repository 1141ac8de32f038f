"""Each rule changes an unsafe command, or makes the robot hold."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from frobs_core.contracts import CommandMode, MeasuredRobot
from frobs_core.description import Placement
from frobs_core.plugins import get_record
from frobs_core.util.errors import ParameterValueError, UnsuitableRobotError
from frobs_ros2.errors import SettingsError
from frobs_ros2.guard import safety_filter
from frobs_ros2.ros import joints_of
from frobs_ros2.safety import RULES, Limits, SafetyFilter

DT = 0.02


def safe(tool: Any = None, log: Path | None = None, **settings: Any) -> SafetyFilter:
    wide = {"lower": [-1.0, -1.0], "upper": [1.0, 1.0], "velocity": [2.0, 2.0], "effort": [10.0, 10.0]}
    arrays = {name: np.array(settings.pop(name, row)) for name, row in wide.items()}
    made = SafetyFilter(Limits(joint_names=("a", "b"), **arrays, **settings), DT, tool, log)
    made.start(np.zeros(2), 0.0, 0.0)
    made.press(True, 0.0)
    return made


def test_allowed_command_is_sent_unchanged() -> None:
    rules = safe()
    np.testing.assert_array_equal(rules.command("position", np.array([0.03, -0.02]), 0.0), [0.03, -0.02])
    assert not rules.counts


@pytest.mark.parametrize("mode", ["position", "velocity", "effort"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_command_that_is_not_finite_makes_the_robot_hold(mode: str, value: float) -> None:
    rules = safe()
    np.testing.assert_array_equal(rules.command(mode, np.array([0.01, value]), 0.0), [0.0, 0.0])
    assert rules.counts == {"finite": 1}
    assert "not finite" in rules.held


def test_position_beyond_a_limit_is_clipped() -> None:
    rules = safe(velocity=[1e3, 1e3])
    assert rules.command("position", np.array([5.0, 0.0]), 0.0)[0] == 1.0
    assert rules.counts == {"position": 1}


def test_velocity_toward_a_limit_is_reduced_near_it() -> None:
    rules = safe()
    rules.start(np.array([0.99, 0.0]), 0.0)
    assert rules.command("velocity", np.array([2.0, 2.0]), 0.0).tolist() == pytest.approx([0.1, 2.0])
    rules.start(np.array([1.2, 0.0]), 0.0)
    assert rules.command("velocity", np.array([2.0, 0.0]), 0.0)[0] == 0.0
    assert rules.command("velocity", np.array([-2.0, 0.0]), 0.0)[0] == -2.0


@pytest.mark.parametrize("mode", ["position", "velocity"])
@pytest.mark.parametrize("start", [0.0, 0.95, 1.3, -1.1])
def test_all_limits_hold_together(mode: str, start: float) -> None:
    """A joint that moves fast toward its limit stops there, although the acceleration limit would carry it on."""
    random = np.random.default_rng(0)
    rules, positions, now = safe(acceleration=2.0, velocity=[1.5, 1.5]), np.full(2, start), 0.0
    rules.start(positions, now)
    for step in range(2_000):
        asked = np.array([9.0, -9.0]) if step % 400 < 200 else random.normal(0.0, 3.0, 2)
        sent = rules.command(mode, asked, now)
        moved = sent if mode == "position" else positions + DT * sent
        assert (moved >= np.minimum(positions, -1.0) - 1e-9).all()
        assert (moved <= np.maximum(positions, 1.0) + 1e-9).all()
        assert (np.abs(moved - positions) <= 1.5 * DT + 1e-6).all()
        positions, now = moved, now + DT
        assert rules.measure(now, positions, np.zeros(2), now) == ""


def test_command_may_not_be_faster_than_the_velocity_limit() -> None:
    rules = safe(speed=0.5)
    assert rules.command("position", np.array([0.5, 0.0]), 0.0)[0] == pytest.approx(0.5 * 2.0 * DT)
    assert rules.command("velocity", np.array([0.0, -9.0]), 0.0)[1] == pytest.approx(-1.0)
    assert rules.counts["velocity"] == 2


def test_acceleration_is_limited() -> None:
    rules = safe(acceleration=5.0)
    sent = [rules.command("velocity", np.array([2.0, 0.0]), i * DT)[0] for i in range(3)]
    np.testing.assert_allclose(sent, [0.1, 0.2, 0.3], atol=1e-6)
    rules = safe(acceleration=5.0)
    rows = [0.0, *(rules.command("position", np.array([1.0, 0.0]), i * DT)[0] for i in range(5))]
    assert np.abs(np.diff(rows, 2)).max() <= 5.0 * DT * DT + 1e-6


def test_effort_is_clipped() -> None:
    assert safe().command("effort", np.array([50.0, -50.0]), 0.0).tolist() == [10.0, -10.0]


def test_tool_stays_in_the_workspace() -> None:
    box = np.array([[-0.01, -1.0, -1.0], [0.02, 1.0, 1.0]])
    rules = safe(tool=lambda q: np.array([q[0], 0.0, 0.0]), workspace=box)
    assert rules.command("position", np.array([0.015, 0.0]), 0.0)[0] == 0.015
    assert rules.command("position", np.array([0.03, 0.0]), DT)[0] <= 0.02
    assert "workspace" in rules.held
    assert rules.command("velocity", np.array([2.0, 0.0]), 2 * DT)[0] == 0.0


def test_robot_starts_slowly_and_again_after_a_hold() -> None:
    rules = safe(slow_start=1.0)
    first = rules.command("velocity", np.array([2.0, 0.0]), 0.0)[0]
    later = rules.command("velocity", np.array([2.0, 0.0]), 1.0)[0]
    assert first == pytest.approx(0.2)
    assert later == pytest.approx(2.0)
    rules.hold("velocity", "test", 1.0)
    assert rules.command("velocity", np.array([2.0, 0.0]), 1.0)[0] == pytest.approx(0.2)


@pytest.mark.parametrize(("released", "now"), [(True, 0.0), (False, 0.6)], ids=["released", "signal is old"])
def test_robot_holds_without_the_dead_man_switch(released: bool, now: float) -> None:
    rules = safe(deadman=True)
    assert rules.command("velocity", np.array([1.0, 0.0]), 0.0)[0] == 1.0
    if released:
        rules.press(False, now)
    assert rules.command("velocity", np.array([1.0, 0.0]), now)[0] == 0.0
    assert rules.counts == {"dead-man": 1}


@pytest.mark.parametrize(
    ("stamp", "position", "now", "reason"),
    [
        (0.02, np.nan, 0.02, "not finite"),
        (0.00, 0.0, 0.02, "repeated"),
        (-0.02, 0.0, 0.02, "older than the one before"),
        (0.02, 0.0, 0.30, "0.28 s old"),
        (5.00, 0.0, 0.02, "5 s ahead of the clock"),
        (0.02, 0.5, 0.02, "jumped by 0.5"),
    ],
    ids=["NaN", "repeated", "reordered", "late", "early", "jump"],
)
def test_faulty_measurement_is_not_used(stamp: float, position: float, now: float, reason: str) -> None:
    rules = safe()
    found = rules.measure(stamp, np.array([position, 0.0]), np.zeros(2), now)
    assert reason in found
    rules.command("velocity", np.array([1.0, 0.0]), 0.0)
    assert rules.hold("velocity", found, now).tolist() == [0.0, 0.0]
    assert rules.counts == {"measurement": 1}
    assert rules.measure(0.04, np.array([0.01, 0.0]), np.zeros(2), 0.04) == "" or np.isnan(position) or position > 0.1


def test_lost_measurement_lets_the_joint_move_on() -> None:
    rules = safe()
    assert rules.measure(0.1, np.array([0.2, 0.0]), np.zeros(2), 0.1) == ""


def test_held_position_is_near_the_measured_one() -> None:
    rules = safe(velocity=[100.0, 100.0])
    rules.command("position", np.array([0.9, 0.0]), 0.0)
    rules = safe()
    for i in range(20):
        rules.command("position", np.array([0.9, 0.0]), i * DT)
    assert rules.hold("position", "test", 1.0)[0] == pytest.approx(2.0 * DT)


def test_each_change_is_logged_with_its_reason(tmp_path: Path) -> None:
    log = tmp_path / "changes.jsonl"
    rules = safe(log=log)
    rules.command("effort", np.array([50.0, 0.0]), 3.0)
    row = json.loads(log.read_text("utf-8"))
    assert row == {"time": 3.0, "rule": "effort", "reason": "joint 'a': 50 became 10", "asked": [50.0, 0.0], "sent": [10.0, 0.0]}  # fmt: skip
    assert row["rule"] in RULES


def test_log_that_cannot_be_written_is_an_error_before_the_first_command(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"changes\.jsonl cannot be written"):
        safe(log=tmp_path / "missing" / "changes.jsonl")


def test_robot_holds_although_the_log_can_no_longer_be_written(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    log = tmp_path / "changes.jsonl"
    rules = safe(log=log)
    log.unlink()
    log.mkdir()
    assert rules.command("velocity", np.array([1.0, 0.0]), 0.0)[0] == 1.0
    assert rules.hold("velocity", "no measurement", 0.0).tolist() == [0.0, 0.0]
    assert rules.counts == {"measurement": 1}
    assert "changes.jsonl cannot be written" in caplog.text


@pytest.mark.parametrize(("mode", "held"), [("position", 0.7), ("velocity", 0.0), ("effort", 0.0)])
def test_robot_holds_where_it_is_before_the_first_command(mode: str, held: float) -> None:
    rules = safe()
    rules.start(np.array([0.7, 0.0]), 0.0)
    assert rules.hold(mode, "no measurement", 0.0)[0] == held


@pytest.mark.parametrize(
    ("position", "velocity", "effort", "expected"),
    [
        ([1.0, 2.0, 3.0], [], [], ([3.0, 1.0], [0.0, 0.0], [0.0, 0.0])),
        ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0], ([3.0, 1.0], [6.0, 4.0], [9.0, 7.0])),
        ([1.0, 2.0], [4.0], [7.0, 8.0, 9.0, 0.0], ([np.nan] * 2, [np.nan] * 2, [np.nan] * 2)),
        ([], [], [], ([np.nan] * 2, [0.0, 0.0], [0.0, 0.0])),
    ],
)
def test_joint_states_of_a_wrong_size_are_not_numbers(position: Any, velocity: Any, effort: Any, expected: Any) -> None:
    message = SimpleNamespace(name=["a", "x", "b"], position=position, velocity=velocity, effort=effort)
    read = joints_of(message, ["b", "a"])
    assert read is not None
    np.testing.assert_array_equal(np.array(read), np.array(expected))
    assert joints_of(message, ["a", "c"]) is None


def test_workspace_needs_a_lower_and_an_upper_corner() -> None:
    with pytest.raises(SettingsError, match="lower corner"):
        safe(workspace=np.array([[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"acceleration": -1.0}, "acceleration is -1; it must be a finite number above 0"),
        ({"acceleration": np.nan}, "acceleration is nan"),
        ({"slow_start": np.nan}, "slow_start is nan"),
        ({"max_age": np.nan}, "max_age is nan"),
    ],
)
def test_limits_that_would_not_limit_are_an_error(settings: dict[str, float], message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        safe(**settings)


@pytest.mark.parametrize(
    ("mode", "settings", "message"),
    [
        (CommandMode.EFFORT, {"workspace": [[0.0] * 3, [1.0] * 3]}, "an effort does not say where the tool moves"),
        (CommandMode.POSITION, {"workspace": [[0.0] * 3]}, "a lower and an upper corner"),
        (CommandMode.POSITION, {"workspace": 1.0}, "a lower and an upper corner"),
        (CommandMode.POSITION, {"slow_start": "long"}, "safety: slow_start"),
    ],
)
def test_settings_of_a_simulator_that_cannot_be_used_are_named(
    mode: CommandMode, settings: dict[str, Any], message: str
) -> None:
    robot = get_record("robot", "irb120").load()
    handle = MeasuredRobot()
    handle.describe("robot", Placement(robot=robot, model=robot.read_model(), command_mode=mode), 1)
    with pytest.raises(ParameterValueError, match=message):
        safety_filter(handle, settings)


def test_joints_with_different_command_modes_are_rejected_before_the_robot_moves() -> None:
    robot = get_record("robot", "irb120").load()
    handle = MeasuredRobot()
    modes = {"joint_1": CommandMode.VELOCITY}
    handle.describe("robot", Placement(robot=robot, model=robot.read_model(), command_mode=modes), 1)
    with pytest.raises(UnsuitableRobotError, match="which the safety rules do not support"):
        safety_filter(handle, {})


def test_documentation_has_a_row_for_each_rule() -> None:
    page = Path(__file__).parents[3] / "docs" / "how-to" / "ros2.md"
    rows = {line.split("|")[1].strip() for line in page.read_text("utf-8").splitlines() if line.startswith("| ")}
    assert {*RULES, "watchdog"} - rows == set()
