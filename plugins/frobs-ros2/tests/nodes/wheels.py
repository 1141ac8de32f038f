"""A node written with rclpy alone that drives a mobile robot and reads its odometry and lidar."""

import json
import time

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

rclpy.init()
node = rclpy.create_node("wheels", namespace="kobuki")
odometry: list[Odometry] = []
scans: list[LaserScan] = []
node.create_subscription(Odometry, "odom", odometry.append, 10)
node.create_subscription(LaserScan, "scan", scans.append, 10)
publisher = node.create_publisher(Twist, "cmd_vel", 10)
twist = Twist()
twist.linear.x = 0.2
node.create_timer(0.02, lambda: publisher.publish(twist))
end = time.monotonic() + 100.0


def moved():
    first, last = (message.pose.pose.position for message in (odometry[0], odometry[-1]))
    return ((last.x - first.x) ** 2 + (last.y - first.y) ** 2) ** 0.5


while time.monotonic() < end and not (odometry and scans and moved() > 0.1):
    rclpy.spin_once(node, timeout_sec=0.1)
scan, odom = scans[-1], odometry[-1]
result = {
    "moved": moved(),
    "speed": odom.twist.twist.linear.x,
    "rays": len(scan.ranges),
    "angles": [scan.angle_min, scan.angle_max],
    "in_range": all(scan.range_min <= value <= scan.range_max + 1e-3 for value in scan.ranges),
    "frames": [odom.header.frame_id, odom.child_frame_id],
}
print(json.dumps(result))
rclpy.shutdown()
