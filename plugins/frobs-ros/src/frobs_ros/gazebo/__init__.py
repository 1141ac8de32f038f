"""Implements the functions of :mod:`frobs_ros.ros_gazebo`, grouped by subject: launching, physics, time and models."""
