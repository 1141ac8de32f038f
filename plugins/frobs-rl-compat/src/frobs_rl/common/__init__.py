"""FRobs_RL's helpers for ROS and Gazebo. Each module re-exports the ``frobs_ros`` module of the same name."""
