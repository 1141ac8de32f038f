"""What a policy publishes for RViz: the path of the tool or base, and the markers of the task."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import yaml

from frobs_core.kernel.env import RobotEnv
from frobs_core.models import Pose
from frobs_ros import rviz
from frobs_ros.policy_node.running import Report
from frobs_ros.policy_node.visualization import MARKERS, PATH, Visualization
from frobs_ros.rviz.__main__ import main


class Viewer:
    """Hears both topics."""

    def __init__(self) -> None:
        import rospy
        from nav_msgs.msg import Path
        from visualization_msgs.msg import MarkerArray

        self.paths: list[Any] = []
        self.markers: list[Any] = []
        self._topics = [
            rospy.Subscriber(f"/seen/{PATH}", Path, self.paths.append),
            rospy.Subscriber(f"/seen/{MARKERS}", MarkerArray, self.markers.append),
        ]

    def close(self) -> None:
        for topic in self._topics:
            topic.unregister()


@pytest.fixture
def viewer(rosmaster: str) -> Iterator[Viewer]:
    with closing(Viewer()) as viewer:
        yield viewer


def until(condition: Callable[[], Any]) -> None:
    end = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def shown(
    env: RobotEnv, viewer: Viewer, move: Callable[[int], Any], count: int, restart_before: int | None = None
) -> tuple[Any, Any]:
    """Return the path and the markers, by name, after a robot was moved several times."""
    report, made = Report(), Visualization(env, "/seen/")
    until(lambda: made._path.get_num_connections() and made._markers.get_num_connections())
    for number in range(count):
        report.restarts += number == restart_before
        move(number)
        time.sleep(0.11)
        made.update(report)
        until(lambda: len(viewer.paths) == len(viewer.markers) == number + 1)  # noqa: B023 - it is called here
    made._path.unregister()
    made._markers.unregister()
    return viewer.paths[-1], {marker.ns: marker for marker in viewer.markers[-1].markers}


def xyz(point: Any) -> list[float]:
    return [point.x, point.y, point.z]


def made(id: str, goal: list[float]) -> RobotEnv:
    env = gym.make(f"frobs_core:{id}", disable_env_checker=True).unwrapped
    env.reset(seed=0, options={"goal": goal})
    return env  # type: ignore[return-value]


def test_the_tool_and_the_goal_of_an_arm_are_told_in_the_frame_of_its_root_link(viewer: Viewer) -> None:
    with closing(made("frobs/Irb120Reach-v0", [0.3, 0.1, 0.5])) as env:
        robot, angles = env.robot, np.array([0.0, 0.0, 0.2, 0.4])
        turned = Pose((1.0, 0.0, 0.5), (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))  # the base stands elsewhere in the world
        robot.write_base_pose(np.array([turned.pos]), np.array([turned.quat_wxyz]))

        def move(number: int) -> None:
            robot.write_joint_state(np.full((1, 6), angles[number]))
            env.task.advance(env.step_context)

        path, markers = shown(env, viewer, move, len(angles))
        tools, _ = robot.model.frame_pose(robot.tcp, np.repeat(angles[[0, 2, 3], None], 6, axis=1))
        assert path.header.frame_id == markers["goal"].header.frame_id == robot.model.root
        assert [xyz(pose.pose.position) for pose in path.poses] == pytest.approx(tools, abs=1e-6)
        assert xyz(markers["tool"].pose.position) == pytest.approx(tools[-1], abs=1e-6)
        assert markers["goal"].scale.x == pytest.approx(2.0 * env.task.tolerance)  # type: ignore[attr-defined]


def test_a_base_is_told_in_the_frame_of_its_odometry_and_a_new_episode_begins_a_new_path(viewer: Viewer) -> None:
    with closing(made("frobs/KobukiDynamic-v0", [2.5, 0.7])) as env:
        env.robot.odom_frame = "odom"  # type: ignore[attr-defined]
        places = np.array([[[x, 0.0, 0.0]] for x in (0.0, 1.0, 2.0, 3.0)])
        upright = np.array([[1.0, 0.0, 0.0, 0.0]])
        path, markers = shown(env, viewer, lambda n: env.robot.write_base_pose(places[n], upright), 4, restart_before=2)
        assert path.header.frame_id == markers["goal"].header.frame_id == "odom"
        assert [xyz(pose.pose.position) for pose in path.poses] == pytest.approx(places[2:, 0])
        assert xyz(markers["goal"].pose.position)[:2] == pytest.approx([2.5, 0.7])


@pytest.mark.parametrize(("kind", "frame"), [("arm", "base_link"), ("mobile", "odom")])
def test_configurations_of_rviz_are_found_and_show_what_is_published(
    kind: str, frame: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["rviz", kind])
    main()
    path = capsys.readouterr().out.strip()
    assert path == str({"arm": rviz.ARM, "mobile": rviz.MOBILE}[kind])
    with open(path) as file:
        manager = yaml.safe_load(file)["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == frame
    topics = {display.get("Topic", display.get("Marker Topic")) for display in manager["Displays"]}
    assert topics - {None} == {PATH, MARKERS, *(["scan"] if kind == "mobile" else [])}
