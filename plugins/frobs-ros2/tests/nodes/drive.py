"""A node written with rclpy alone that commands joint velocities at 50 Hz until it is killed."""

import rclpy
from std_msgs.msg import Float64MultiArray

rclpy.init()
node = rclpy.create_node("drive")
publisher = node.create_publisher(Float64MultiArray, "forward_velocity_controller/commands", 10)
timer = node.create_timer(0.02, lambda: publisher.publish(Float64MultiArray(data=[0.2, 0.0, 0.0, 0.0, 0.0, 0.0])))
rclpy.spin(node)
