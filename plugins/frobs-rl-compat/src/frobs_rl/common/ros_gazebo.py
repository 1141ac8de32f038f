"""Launch Gazebo and work with its services: the functions of :mod:`frobs_ros.ros_gazebo`."""

from frobs_ros.ros_gazebo import *
from frobs_ros.ros_gazebo import __all__ as __all__
