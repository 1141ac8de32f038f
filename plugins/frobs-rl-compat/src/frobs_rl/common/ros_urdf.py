"""Functions that parse and load URDF and xacro files, re-exported from :mod:`frobs_rl_compat.ros.ros_urdf`."""

from frobs_rl_compat.ros.ros_urdf import *
