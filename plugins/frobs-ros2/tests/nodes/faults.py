"""A robot written with rclpy alone whose joint states have faults, and that prints how its commands move it meanwhile.

The robot takes each commanded position at once. For each fault, it prints the largest change of the command in a period
after the node was told that it holds.
"""

import argparse
import json
import math
import time
from pathlib import Path

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String

parser = argparse.ArgumentParser()
parser.add_argument("--description", type=Path, required=True)
parser.add_argument("--period", type=float, required=True)
parser.add_argument("--names", nargs="+", required=True)
parser.add_argument("--home", nargs="+", type=float, required=True)
options = parser.parse_args()

rclpy.init()
node = rclpy.create_node("faults")
positions = list(options.home)
commands: list[list[float]] = []


def receive(command: Float64MultiArray) -> None:
    commands.append(list(command.data))
    positions[:] = command.data


node.create_subscription(Float64MultiArray, "forward_position_controller/commands", receive, 50)
states = node.create_publisher(JointState, "joint_states", 10)
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
node.create_publisher(String, "robot_description", latched).publish(String(data=options.description.read_text("utf-8")))


def wait(seconds: float) -> None:
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        rclpy.spin_once(node, timeout_sec=left)


def send(late: float = 0.0, first: float | None = None, stamp: float | None = None) -> float:
    """Send a joint state, of ``late`` seconds ago, with a wrong position of the first joint, or with another stamp."""
    stamp = 1e-9 * node.get_clock().now().nanoseconds - late if stamp is None else stamp
    state = JointState(name=options.names, position=positions, velocity=[0.0] * len(positions))
    if first is not None:
        state.position[0] = first
    state.header.stamp.sec, state.header.stamp.nanosec = int(stamp), int(1e9 * (stamp % 1.0))
    states.publish(state)
    wait(options.period)
    return stamp


def act(count: int) -> float:
    """Send joint states until the other node has acted some times, and return the last stamp."""
    seen, end, stamp = len(commands), time.monotonic() + 60.0, 0.0
    while len(commands) < seen + count and time.monotonic() < end:
        stamp = send()
    return stamp


act(20)
moved = {}
for fault in ("late", "repeated", "reordered", "NaN", "jump", "lost"):
    last = act(10)
    wait(0.1)  # the node has answered all joint states
    before = list(positions)
    for i in range(10):
        if fault == "lost":
            wait(options.period)
        elif fault == "repeated":
            send(stamp=last)
        elif fault == "reordered":
            send(stamp=last - 0.01 * (i + 1))
        elif fault == "late":
            send(late=5.0)
        else:
            send(first=math.nan if fault == "NaN" else positions[0] + (3.0 if i % 2 else -3.0))
    moved[fault] = max(abs(a - b) for a, b in zip(positions, before, strict=True))
act(20)
print(json.dumps(moved))
rclpy.shutdown()
