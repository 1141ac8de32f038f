"""FRobs_RL's helpers for ROS and Gazebo; each module is the one of the same name in ``frobs_ros``.

Where ROS is installed, ``import rospy`` works once this is imported.
"""

from frobs_rl_compat.ros import find_and_use_ros

find_and_use_ros()
