"""Implements the functions of :mod:`frobs_rl_compat.ros.ros_gazebo`, by subject: launching, physics, time and models."""
