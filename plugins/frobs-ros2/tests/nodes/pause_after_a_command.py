"""A node written with rclpy alone that pauses the world after it has seen some commands."""

import time

import rclpy
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool

rclpy.init()
node = rclpy.create_node("pause")
commands: list[Float64MultiArray] = []
node.create_subscription(Float64MultiArray, "forward_position_controller/commands", commands.append, 10)
client = node.create_client(SetBool, "pause")
end = time.monotonic() + 100.0
while len(commands) < 10 and time.monotonic() < end:
    rclpy.spin_once(node, timeout_sec=0.1)
assert client.wait_for_service(100.0)
future = client.call_async(SetBool.Request(data=True))
rclpy.spin_until_future_complete(node, future)
print("paused", end="")
rclpy.shutdown()
