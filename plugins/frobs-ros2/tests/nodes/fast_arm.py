"""A robot written with rclpy alone: sends joint states at a fixed rate, and measures when each command arrives.

With ``--echo`` it is the other end: a node that answers each joint state at once.
"""

import argparse
import json
import time
from pathlib import Path

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String

STATES, COMMANDS = "joint_states", "forward_position_controller/commands"

parser = argparse.ArgumentParser()
parser.add_argument("--echo", action="store_true")
parser.add_argument("--description", type=Path)
parser.add_argument("--names", nargs="+")
parser.add_argument("--home", nargs="+", type=float)
parser.add_argument("--rate", type=float, default=200.0)
parser.add_argument("--cycles", type=int, default=2_000)
options = parser.parse_args()

rclpy.init()
node = rclpy.create_node("echo" if options.echo else "loopback", start_parameter_services=False)
if options.echo:
    publisher = node.create_publisher(Float64MultiArray, COMMANDS, 10)
    answer = lambda state: publisher.publish(Float64MultiArray(data=state.position))  # noqa: E731
    node.create_subscription(JointState, STATES, answer, 10)
    rclpy.spin(node)

arrived: list[float] = []
positions = list(options.home)


def receive(command: Float64MultiArray) -> None:
    arrived.append(time.perf_counter())
    positions[:] = command.data


node.create_subscription(Float64MultiArray, COMMANDS, receive, 50)
states = node.create_publisher(JointState, STATES, 10)
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
description = node.create_publisher(String, "robot_description", latched)
if options.description:
    description.publish(String(data=options.description.read_text("utf-8")))


def wait_until(end: float) -> None:
    while (left := end - time.perf_counter()) > 0.0:
        rclpy.spin_once(node, timeout_sec=left)


def cycle(due: float) -> tuple[float, float]:
    """Send a joint state, wait for the end of the period, and return when both happened."""
    state = JointState(name=options.names, position=positions, velocity=[0.0] * len(positions))
    state.header.stamp = node.get_clock().now().to_msg()
    sent = time.perf_counter()
    states.publish(state)
    due = max(due + 1.0 / options.rate, sent)
    wait_until(due)
    return sent, due


due = time.perf_counter()
end = due + 60.0
while len(arrived) < 200 and due < end:  # the other node starts and warms up
    _, due = cycle(due)
wait_until(due + 0.15)
arrived.clear()
due, sent = time.perf_counter(), []
for _ in range(options.cycles):
    began, due = cycle(due)
    sent.append(began)
wait_until(due + 1.0)
trips = [1e3 * (end - start) for start, end in zip(sent, arrived, strict=False)]
print(json.dumps({"sent": len(sent), "arrived": len(arrived), "milliseconds": trips}))
rclpy.shutdown()
