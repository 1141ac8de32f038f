"""Functions that start and stop launch files, re-exported from :mod:`frobs_rl_compat.ros.ros_launch`."""

from frobs_rl_compat.ros.ros_launch import *
