"""Start and stop launch files: the functions of :mod:`frobs_ros.ros_launch`."""

from frobs_ros.ros_launch import *
