"""The actions of ros2_control, with a fake of their types: the wheels of ROS 2 do not contain control_msgs."""

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_ros2.ros import FEATURES, optional_type
from frobs_ros2.serve import actions


class FakeRobot:
    """A robot that follows a trajectory for three polls, and whose fingers move halfway to their target per poll."""

    namespace = "arm/"

    def __init__(self, valid: bool = True) -> None:
        self.commands, self.time, self.held, self._valid, self._polls = 0, 0.0, False, valid, 0
        self.handle = SimpleNamespace(joint_positions=np.zeros((1, 1)))

    def follow(self, trajectory: Any) -> None:
        self.commands += self._valid

    @property
    def is_done(self) -> bool:
        self._polls += 1
        return self._polls > 3

    def hold(self) -> None:
        self.held = True

    def set_command(self, mode: CommandMode, columns: list[int], values: list[float]) -> None:
        self.commands += 1
        self.handle.joint_positions[0, columns] = values


class FakeResult(SimpleNamespace):
    SUCCESSFUL, INVALID_GOAL = 0, -1


@pytest.fixture
def offered(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    found: dict[str, Any] = {}
    monkeypatch.setattr(actions, "_serve", lambda node, kind, name, execute: found.update({name: execute}))
    return found


def ask(execute: Any, cancel: bool = False, meanwhile: Any = None) -> tuple[Any, list[str]]:
    events: list[str] = []
    command = SimpleNamespace(position=0.04)
    goal = SimpleNamespace(
        request=SimpleNamespace(trajectory=None, command=command),
        is_cancel_requested=cancel,
        **{name: lambda name=name: events.append(name) for name in ("abort", "canceled", "succeed")},  # type: ignore[misc]
    )
    task = execute(goal)
    while True:
        try:
            task.send(None)
        except StopIteration as stop:
            return stop.value, events
        if meanwhile is not None:
            meanwhile()


def offer(offered: dict[str, Any], robot: FakeRobot) -> Any:
    actions.offer_follow(robot, None, SimpleNamespace(Result=FakeResult))  # type: ignore[arg-type]
    return offered["arm/joint_trajectory_controller/follow_joint_trajectory"]


def test_one_line_names_the_features_whose_types_are_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[str] = []
    for package, feature in FEATURES.items():
        monkeypatch.setitem(sys.modules, f"{package}.msg", None)
        assert optional_type(f"{package}/msg/Any", lines.append) is None
        assert lines.pop() == f"not available, because {package} is not installed: {feature}"


def test_goal_succeeds_when_the_trajectory_is_over(offered: dict[str, Any]) -> None:
    result, events = ask(offer(offered, FakeRobot()))
    assert events == ["succeed"]
    assert result.error_code == 0


def test_invalid_goal_is_aborted(offered: dict[str, Any]) -> None:
    result, events = ask(offer(offered, FakeRobot(valid=False)))
    assert events == ["abort"]
    assert result.error_code == -1


def test_canceled_goal_stops_the_robot(offered: dict[str, Any]) -> None:
    robot = FakeRobot()
    _, events = ask(offer(offered, robot), cancel=True)
    assert events == ["canceled"]
    assert robot.held


def test_another_command_replaces_the_goal(offered: dict[str, Any]) -> None:
    robot = FakeRobot()
    _, events = ask(offer(offered, robot), meanwhile=lambda: robot.follow(None))
    assert events == ["abort"]


def test_gripper_reaches_its_goal(offered: dict[str, Any]) -> None:
    actions.offer_gripper(FakeRobot(), None, SimpleNamespace(Result=FakeResult), [0])  # type: ignore[arg-type]
    result, events = ask(offered["arm/gripper_controller/gripper_cmd"])
    assert events == ["succeed"]
    assert result.reached_goal
