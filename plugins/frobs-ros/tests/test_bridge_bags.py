"""ROS's own rosbag records what a served robot says, and plays it back."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

INERTIA = '<inertial><mass value="1"/><inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>'
ROBOT = f"""<robot name="looker"><link name="world"/><link name="base">{INERTIA}<visual><geometry><box size=".2 .2 .2"/></geometry></visual></link>
<joint name="f" type="fixed"><origin xyz="0 0 0.5"/><parent link="world"/><child link="base"/></joint>
<link name="head">{INERTIA}</link><joint name="neck" type="continuous"><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/><parent link="base"/><child link="head"/></joint>
<gazebo reference="head"><sensor type="camera" name="eye"><update_rate>10</update_rate><camera><horizontal_fov>1</horizontal_fov>
<image><width>64</width><height>48</height></image></camera><plugin name="c" filename="libgazebo_ros_camera.so">
<cameraName>eye</cameraName></plugin></sensor>
<sensor type="imu" name="i"><update_rate>50</update_rate><plugin name="i" filename="libgazebo_ros_imu_sensor.so"><topicName>imu</topicName>
<updateRateHZ>50</updateRateHZ></plugin></sensor>
<sensor type="ray" name="laser"><update_rate>20</update_rate><ray><scan><horizontal><samples>9</samples><min_angle>-1</min_angle>
<max_angle>1</max_angle></horizontal></scan><range><min>0.05</min><max>4</max></range></ray>
<plugin name="l" filename="libgazebo_ros_laser.so"><topicName>beams</topicName></plugin></sensor></gazebo></robot>"""
RATES = {"/beams": 20, "/eye/image_raw": 10, "/imu": 50, "/joint_states": 100}  # [Hz] of topics with a header
TOPICS = ["/tf", *RATES]


def rosbag_process(arguments: list[str], uri: str, log: Path) -> subprocess.Popen[bytes]:
    from frobs_ros.ros.environment import child_variables

    environment = {**child_variables(), "ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1"}
    with log.open("ab") as file:
        return subprocess.Popen(
            ["rosbag", *arguments], env=environment, stdout=file, stderr=file, start_new_session=True
        )


def record(topics: list[str], bag: Path, uri: str) -> subprocess.Popen[bytes]:
    """Start to record, and return once all topics have been subscribed to."""
    import rosgraph

    process = rosbag_process(["record", "-O", str(bag), *topics], uri, bag.with_suffix(".log"))
    end = time.monotonic() + 30.0
    while True:
        _, subscribers, _ = rosgraph.Master("/test", uri).getSystemState()
        heard = {topic for topic, nodes in subscribers if any(node.startswith("/record") for node in nodes)}
        if heard >= set(topics):
            return process
        assert process.poll() is None, bag.with_suffix(".log").read_text()
        assert time.monotonic() < end, heard
        time.sleep(0.05)


def finish(process: subprocess.Popen[bytes]) -> None:
    """End a recording, and return once the bag is complete: the command ends before its child, which writes the bag."""
    os.killpg(process.pid, signal.SIGINT)
    process.wait(30.0)
    end = time.monotonic() + 30.0
    with suppress(ProcessLookupError):
        while True:
            os.killpg(process.pid, 0)
            assert time.monotonic() < end, "the recorder does not end"
            time.sleep(0.05)


def read(bag: Path) -> dict[str, list[tuple[Any, ...]]]:
    """Return type, checksum and bytes of each message, by topic."""
    import rosbag

    found: dict[str, list[tuple[Any, ...]]] = {}
    with rosbag.Bag(str(bag)) as opened:
        for topic, (kind, data, checksum, *_), _ in opened.read_messages(raw=True):
            found.setdefault(topic, []).append((kind, checksum, data))
    return found


def stamps(bag: Path, topic: str) -> list[int]:
    import rosbag

    with rosbag.Bag(str(bag)) as opened:
        return [message.header.stamp.to_nsec() for _, message, _ in opened.read_messages([topic])]


@pytest.mark.ros_feature("rosbag", "ros", "mujoco")
@pytest.mark.slow
@pytest.mark.needs("rosbag")
def test_recorded_topics_are_played_back_unchanged(
    bridges: Callable[..., Any], rosmaster: str, second_master: str, tmp_path: Path
) -> None:
    import rosgraph
    import rospy

    from frobs_msgs.srv import StepWorld

    robot = tmp_path / "looker.urdf"
    robot.write_text(ROBOT)
    bridges("--robot", str(robot), "--paused")
    first, second = tmp_path / "first.bag", tmp_path / "second.bag"
    recorder = record(["/clock", *TOPICS], first, rosmaster)
    step = rospy.ServiceProxy("/gazebo/step", StepWorld)
    for _ in range(20):  # until all publishers have connected
        step(10)
        time.sleep(0.05)
    for _ in range(100):
        step(10)
        time.sleep(0.03)  # publishers keep one message for a slow subscriber
    finish(recorder)
    recorded = read(first)
    assert set(recorded) == {"/clock", *TOPICS}
    for topic, rate in RATES.items():
        steps = np.diff(stamps(first, topic)[1:]) / round(1e9 / rate)  # a new component publishes at once
        # On a loaded machine the recorder misses a few messages.
        assert len(steps) >= 0.7 * rate
        assert np.all((steps >= 1.0) & (steps % 1.0 == 0.0)), topic
        assert np.median(steps) == 1.0, topic

    rosgraph.Master("/test", second_master).setParam("/use_sim_time", True)
    recorder = record(TOPICS, second, second_master)
    options = ["--clock", "--wait-for-subscribers", "--delay", "1"]
    player = rosbag_process(["play", *options, str(first), "--topics", *TOPICS], second_master, tmp_path / "play.log")
    assert player.wait(120.0) == 0, (tmp_path / "play.log").read_text()
    time.sleep(0.5)
    finish(recorder)
    played = read(second)
    assert set(played) == set(TOPICS)
    for topic in TOPICS:
        assert len(played[topic]) == len(recorded[topic]) > 0, topic
        assert played[topic] == recorded[topic], topic
