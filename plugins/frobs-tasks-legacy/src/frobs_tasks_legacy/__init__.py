"""FRobs_RL's reaching and navigation tasks, with their observations, rewards and task YAML files, without ROS."""
