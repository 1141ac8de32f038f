"""A node written with rclpy alone that prints when the first joint moves, and how far until it stops."""

import json

import rclpy
from sensor_msgs.msg import JointState

rclpy.init()
node = rclpy.create_node("watch")
rows: list[tuple[float, float, float]] = []


def store(state):
    rows.append((state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec, state.position[0], state.velocity[0]))


node.create_subscription(JointState, "joint_states", store, 50)
while not rows or rows[-1][2] < 0.15:
    rclpy.spin_once(node)
print("moving", flush=True)
while abs(rows[-1][2]) > 0.01:
    rclpy.spin_once(node)
last = max(i for i, row in enumerate(rows) if row[2] > 0.15)
stopped = len(rows)
while len(rows) < stopped + 30:
    rclpy.spin_once(node)
print(json.dumps({"stop_time": rows[stopped - 1][0] - rows[last][0], "drift": abs(rows[-1][1] - rows[stopped][1])}))
rclpy.shutdown()
