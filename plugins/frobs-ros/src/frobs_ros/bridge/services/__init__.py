"""The services of gazebo_ros, each answering as Gazebo does."""
