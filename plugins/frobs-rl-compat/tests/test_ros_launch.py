from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from frobs_rl_compat.ros import ros_launch
from frobs_ros.ros import nodes, processes

LAUNCH = Path(__file__).parent / "packages" / "tiny_arm" / "launch"

pytestmark = pytest.mark.usefixtures("own_master")


@pytest.fixture(autouse=True)
def no_launch_left() -> Iterator[None]:
    yield
    ros_launch.ros_kill_launch_process()


@pytest.mark.parametrize("way", ["package", pytest.param("path", marks=pytest.mark.slow)])
@pytest.mark.ros_feature("launch files", "ros")
@pytest.mark.ros_feature("helper functions of FRobs_RL", "ros")
def test_a_launch_file_runs_with_its_arguments_and_ends_with_its_nodes(way: str) -> None:
    import rospy

    if way == "package":
        assert ros_launch.ros_launch_from_pkg("tiny_arm", "talk.launch", ["word:=hello"]) is True
    else:
        assert ros_launch.ros_launch_from_path(str(LAUNCH / "talk.launch"), ["word:=hello"], False) is True
    assert rospy.get_param("/said") == "hello"
    assert "/talker" in nodes.ours()
    (process,) = processes.owned(["launch"])
    assert len(process.pids()) >= 2
    assert ros_launch.ros_kill_launch_process() is True
    assert processes.owned(["launch"]) == []
    assert nodes.pid_of("/talker") is None if "/talker" in nodes.names() else True


def test_a_launch_file_without_nodes_is_done_at_once() -> None:
    import rospy

    assert ros_launch.ros_launch_from_pkg("tiny_arm", "parameter.launch", launch_new_term=False) is True
    assert rospy.get_param("/only") == "a parameter"


@pytest.mark.parametrize(
    ("file", "args", "reason"),
    [
        ("none.launch", None, "has no file"),
        ("broken.launch", None, "it ended with exit code"),
        ("talk.launch", ["word=hello"], "must be of the form"),
    ],
)
def test_a_launch_that_fails_is_refused_with_a_reason(
    file: str, args: list[str] | None, reason: str, reasons: Callable[[], str]
) -> None:
    assert ros_launch.ros_launch_from_pkg("tiny_arm", file, args) is False
    assert reason in reasons()
    assert processes.owned(["launch"]) == []


def test_a_file_that_is_not_there_is_refused(reasons: Callable[[], str]) -> None:
    assert ros_launch.ros_launch_from_path("/no/such.launch") is False
    assert "does not exist; pass the path of a launch file" in reasons()
