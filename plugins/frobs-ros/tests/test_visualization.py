"""What a policy publishes for RViz: the path of the tool or base, and the markers of the task."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest
import yaml

from frobs_core.models import Pose
from frobs_ros import rviz
from frobs_ros.policy_node.mirror import Mirror, State
from frobs_ros.policy_node.policy_loop import Report
from frobs_ros.policy_node.visualization import MARKERS, PATH, Visualization
from frobs_ros.rviz.__main__ import main
from frobs_train.export.pretrained import read_pretrained


class StillRobot:
    """A robot whose clock a test sets."""

    odom_frame = "odom"
    time = 0.0

    def now(self) -> float:
        return self.time


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


def shown(mirror: Mirror, viewer: Viewer, states: list[State], restart_before: int | None = None) -> tuple[Any, Any]:
    """Return the path and the markers, by name, after a robot was in some states."""
    robot, report = StillRobot(), Report()
    made = Visualization(robot, mirror, "/seen/")  # type: ignore[arg-type]
    until(lambda: made._path.get_num_connections() and made._markers.get_num_connections())
    for number, state in enumerate(states):
        report.restarts += number == restart_before
        mirror.observe(state)
        mirror.act(np.ones(mirror.env.action_space.shape or ()))  # moves the mirror, but not the robot
        robot.time += 1.0
        made.update(report)
        until(lambda: len(viewer.paths) == len(viewer.markers) == number + 1)  # noqa: B023 - it is called here
    made._path.unregister()
    made._markers.unregister()
    return viewer.paths[-1], {marker.ns: marker for marker in viewer.markers[-1].markers}


def xyz(point: Any) -> list[float]:
    return [point.x, point.y, point.z]


def test_the_tool_and_the_goal_of_an_arm_are_told_in_the_frame_of_its_root_link(viewer: Viewer) -> None:
    with closing(Mirror(read_pretrained("frobs/Irb120Reach-v0"))) as mirror:
        states = [State(np.full(6, angle), np.zeros(6)) for angle in (0.0, 0.0, 0.2, 0.4)]
        mirror.begin(states[0], {"goal": np.array([0.3, 0.1, 0.5])})
        handle = mirror.env.robot
        turned = Pose((1.0, 0.0, 0.5), (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))  # the base stands elsewhere in the world
        handle.write_base_pose(np.array([turned.pos]), np.array([turned.quat_wxyz]))
        path, markers = shown(mirror, viewer, states)
        tools, _ = handle.model.frame_pose(handle.tcp, np.array([states[i].positions for i in (0, 2, 3)]))
        assert path.header.frame_id == markers["goal"].header.frame_id == handle.model.root
        assert [xyz(pose.pose.position) for pose in path.poses] == pytest.approx(tools, abs=1e-6)
        assert xyz(markers["tool"].pose.position) == pytest.approx(tools[-1], abs=1e-6)
        assert markers["goal"].scale.x == pytest.approx(2.0 * mirror.env.task.tolerance)  # type: ignore[attr-defined]


def test_a_base_is_told_in_the_frame_of_its_odometry_and_a_new_episode_begins_a_new_path(viewer: Viewer) -> None:
    with closing(Mirror(read_pretrained("frobs/KobukiDynamic-v0"))) as mirror:
        assert mirror.goal_size == 2
        places = [np.array([x, 0.0, 0.0]) for x in (0.0, 1.0, 2.0, 3.0)]
        quat = np.array([1.0, 0.0, 0.0, 0.0])
        scans = {name: np.full(lidar.rays, 5.0) for name, lidar in mirror.lidars.items()}
        states = [State(np.zeros(2), np.zeros(2), (at, quat, np.zeros(3), np.zeros(3)), scans) for at in places]
        mirror.begin(states[0], {"goal": np.array([2.5, 0.7])})
        path, markers = shown(mirror, viewer, states, restart_before=2)
        assert path.header.frame_id == markers["goal"].header.frame_id == "odom"
        assert [xyz(pose.pose.position) for pose in path.poses] == pytest.approx(np.array(places[2:]))
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
