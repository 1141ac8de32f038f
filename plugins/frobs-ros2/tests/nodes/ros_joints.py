"""Reads ``joint_states`` with rclpy, and prints the first message."""

import json

import rclpy
from sensor_msgs.msg import JointState

rclpy.init()
node = rclpy.create_node("reader")
states: list[JointState] = []
node.create_subscription(JointState, "joint_states", states.append, 10)
while not states:
    rclpy.spin_once(node)
print(json.dumps({"names": list(states[0].name), "position": list(states[0].position)}))
rclpy.shutdown()
