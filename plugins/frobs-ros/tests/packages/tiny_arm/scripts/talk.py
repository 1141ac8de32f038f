#!/usr/bin/env python3
"""Says one word, again and again."""

import sys

import rospy
from std_msgs.msg import String

rospy.init_node("talk")
publisher = rospy.Publisher("words", String, queue_size=1, latch=True)
while not rospy.core.is_shutdown():
    publisher.publish(sys.argv[1] if len(sys.argv) > 1 else "nothing")
    rospy.rostime.wallsleep(0.05)
