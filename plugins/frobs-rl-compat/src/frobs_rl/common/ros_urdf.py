"""Parse and load URDF and xacro files: the functions of :mod:`frobs_ros.ros_urdf`."""

from frobs_ros.ros_urdf import *
