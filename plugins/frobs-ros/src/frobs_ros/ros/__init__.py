"""Finds ROS 1, starts and ends its processes, and talks to its master, nodes and services."""

import logging

LOG = logging.getLogger("rosout.frobs_ros")
"""Child of rospy's logger. After ``rospy.init_node``, messages appear on the screen, in ROS's log and on /rosout."""
