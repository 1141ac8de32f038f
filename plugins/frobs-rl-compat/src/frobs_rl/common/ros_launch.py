"""Functions that start and stop launch files, re-exported from :mod:`frobs_ros.ros_launch`."""

from frobs_ros.ros_launch import *
