"""Runs a policy as a ROS node, which reads the measurements of a real robot and sends commands to it."""
