"""Runs a policy bundle as a node of ROS 2, with frobs-deploy and rclpy alone.

kinematics.py    computes link poses from the URDF on ``robot_description``
observation.py   assembles observations from topics
actions.py       converts actions into joint commands
checks.py        compares the robot with the bundle
node.py          the loop

This package does not import the core, so it also runs on Python 3.10: ``python -m frobs_ros2.policy_node BUNDLE``.
"""
