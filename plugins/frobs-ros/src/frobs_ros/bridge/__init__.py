"""Bridge that gives any FRobs simulation the ROS services, topics and controller managers of Gazebo."""
