"""FRobs_RL's functions for ROS, and its base class for environments with Gymnasium's API."""
