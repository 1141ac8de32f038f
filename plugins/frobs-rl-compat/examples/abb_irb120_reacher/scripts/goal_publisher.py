#!/usr/bin/env python3
"""Publishes one goal, again and again: goal_publisher.py X Y Z."""

import rospy
from geometry_msgs.msg import Point

if __name__ == "__main__":
    rospy.init_node("goal_publisher")
    x, y, z = (float(value) for value in rospy.myargv()[1:4])
    publisher = rospy.Publisher("goal_pos", Point, queue_size=1)
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        publisher.publish(Point(x=x, y=y, z=z))
        try:
            rate.sleep()
        except rospy.ROSTimeMovedBackwardsException:
            pass
