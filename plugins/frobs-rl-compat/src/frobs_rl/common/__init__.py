"""FRobs_RL's helpers for ROS and Gazebo; each module contains the functions of the same module in ``frobs_ros``."""
