"""Implements the functions of :mod:`frobs_rl_compat.ros.ros_gazebo`, grouped by subject: launching, physics, time and models."""
