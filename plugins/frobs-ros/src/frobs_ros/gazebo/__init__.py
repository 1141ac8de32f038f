"""The functions of :mod:`frobs_ros.ros_gazebo` by subject: launching, physics, time, models."""
