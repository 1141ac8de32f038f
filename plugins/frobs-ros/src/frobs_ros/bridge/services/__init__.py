"""The services of gazebo_ros, with the same responses as Gazebo."""
