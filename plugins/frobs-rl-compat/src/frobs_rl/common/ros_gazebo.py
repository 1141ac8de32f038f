"""Launch Gazebo and work with its services: the functions of :mod:`frobs_ros.ros_gazebo`."""

from frobs_ros.ros_gazebo import *
