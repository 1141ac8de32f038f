#!/bin/python3
"""Stores which Python runs it, until it is told to fail."""

import sys

import rospy
from gazebo_msgs.srv import SpawnModel

rospy.init_node("which_python")
rospy.set_param("~python", sys.executable)
while not rospy.core.is_shutdown():
    if rospy.has_param("~fail"):
        raise RuntimeError(f"told to fail, with {SpawnModel._md5sum}")
    rospy.rostime.wallsleep(0.05)
