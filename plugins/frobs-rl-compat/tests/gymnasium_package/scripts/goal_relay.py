#!/usr/bin/env python3
"""Shows the goal that the environment publishes, as a marker would be shown."""

import rospy
from geometry_msgs.msg import Point


def show(goal):
    rospy.loginfo("goal at %.2f %.2f", goal.x, goal.y)
    rospy.set_param("last_goal", [goal.x, goal.y])


if __name__ == "__main__":
    rospy.init_node("goal_relay")
    rospy.Subscriber("goal_pos", Point, show)
    rospy.spin()
