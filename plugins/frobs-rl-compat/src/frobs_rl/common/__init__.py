"""FRobs_RL's helpers for ROS and Gazebo; each module is the one of the same name in ``frobs_ros``."""
