"""Bags of ROS 2 with known content, written by rosbags, and by ROS 2's own serializer where rclpy is installed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.plain import plain, to_json

Message = tuple[str, float, str, dict[str, Any]]
"""Topic, time [s], type, and content."""

START = 1_700_000_000 * 10**9  # [ns]


def write_bag(path: Path, messages: Iterable[Message], storage: str = "mcap") -> Path:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_JAZZY)
    with Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()]) as writer:
        connections: dict[str, Any] = {}
        for topic, time, kind, content in sorted(messages, key=lambda message: message[1]):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=types)
            data = content.get("serialized") or types.serialize_cdr(_message(types, kind, content), kind)
            writer.write(connections[topic], START + round(1e9 * time), data)
    return path


def serialized_by(script: Path, variables: Mapping[str, str], messages: Sequence[Message]) -> list[Message]:
    """Return messages whose content another program has serialized."""
    lines = "".join(to_json([kind, plain(content)]) + "\n" for _, _, kind, content in messages)
    command = [sys.executable, str(script)]
    found = subprocess.run(command, env=dict(variables), input=lines, capture_output=True, text=True, check=True).stdout
    return [
        (topic, time, kind, {"serialized": bytes.fromhex(data)})
        for (topic, time, kind, _), data in zip(messages, found.split(), strict=True)
    ]


def _message(types: Any, kind: str, content: dict[str, Any]) -> Any:
    """Return a message in which everything but ``content`` is zero or empty."""
    fields = {}
    for name, (node, value) in types.fielddefs[kind][1]:
        given = content.get(name)
        if node.name == "NAME":
            fields[name] = _message(types, value, given or {})
        elif node.name == "BASE":
            fields[name] = given if given is not None else {"string": "", "bool": False}.get(value[0], 0)
        else:  # a sequence
            element = value[0]
            if element[0].name == "NAME":
                fields[name] = [_message(types, element[1], each) for each in given or []]
            elif element[1][0] == "string":
                fields[name] = list(given or [])
            else:
                fields[name] = np.array([] if given is None else given, element[1][0])
    return types.types[kind](**fields)


def joint_state(
    time: float, names: Sequence[str], positions: Any, topic: str = "/joint_states", **more: Any
) -> Message:
    stamp = {"sec": int(time), "nanosec": round(1e9 * (time % 1.0))}
    content = {"header": {"stamp": stamp}, "name": list(names), "position": np.array(positions, float), **more}
    return topic, time, "sensor_msgs/msg/JointState", content


def forward(time: float, values: Any, topic: str = "/forward_position_controller/commands") -> Message:
    return topic, time, "std_msgs/msg/Float64MultiArray", {"data": np.array(values, float)}


def goal(time: float, position: Any) -> Message:
    point = dict(zip("xyz", map(float, position), strict=True))
    return "/goal", time, "geometry_msgs/msg/PointStamped", {"point": point}


def trajectory(time: float, names: Sequence[str], points: Iterable[tuple[float, Any]]) -> Message:
    listed = [
        {"positions": np.asarray(each, float), "time_from_start": {"sec": int(at), "nanosec": round(1e9 * (at % 1.0))}}
        for at, each in points
    ]
    content = {"joint_names": list(names), "points": listed}
    return "/joint_trajectory_controller/joint_trajectory", time, "trajectory_msgs/msg/JointTrajectory", content


def image(time: float, key: str, pixels: np.ndarray[Any, Any]) -> Message:
    height, width = pixels.shape[:2]
    content = {"height": height, "width": width, "step": 3 * width, "encoding": "rgb8", "data": pixels.reshape(-1)}
    return f"/{key}/image_raw", time, "sensor_msgs/msg/Image", content
