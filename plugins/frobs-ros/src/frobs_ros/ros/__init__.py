"""Finds ROS 1, starts and ends its processes, and talks to its master, nodes and services."""
