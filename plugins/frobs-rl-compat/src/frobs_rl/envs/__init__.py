"""FRobs_RL's base class of environments, in :mod:`frobs_rl.envs.robot_BasicEnv`.

Where ROS is installed, ``import rospy`` works once this is imported.
"""

from frobs_rl_compat.ros import find_and_use_ros

find_and_use_ros()
