"""ROS 1 for FRobs: FRobs_RL's helpers and environments, any simulation as Gazebo, and policies as nodes."""
