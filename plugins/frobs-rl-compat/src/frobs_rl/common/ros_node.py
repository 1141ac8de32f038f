"""Functions that start and stop nodes and other processes, re-exported from :mod:`frobs_ros.ros_node`."""

from frobs_ros.ros_node import *
