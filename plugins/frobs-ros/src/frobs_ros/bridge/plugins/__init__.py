"""Common Gazebo plugins that model files use."""
