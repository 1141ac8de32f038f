#!/usr/bin/env python3
"""Says one word, again and again."""

import sys

import rospy
from std_msgs.msg import String

words = rospy.myargv(sys.argv)
rospy.init_node("talk")
publisher = rospy.Publisher("words", String, queue_size=1, latch=True)
while not rospy.core.is_shutdown():
    publisher.publish(words[1] if len(words) > 1 else "nothing")
    rospy.rostime.wallsleep(0.05)
