"""Plugins of Gazebo that models ask for, where they are simple and common."""
