"""Services of gazebo_ros, with the same responses as in Gazebo."""
