"""Simple and common plugins of Gazebo that model files use."""
