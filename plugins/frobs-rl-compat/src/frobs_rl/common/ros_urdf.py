"""Functions that parse and load URDF and xacro files, re-exported from :mod:`frobs_ros.ros_urdf`."""

from frobs_ros.ros_urdf import *
