"""Functions that start and stop nodes and other processes, re-exported from :mod:`frobs_rl_compat.ros.ros_node`."""

from frobs_rl_compat.ros.ros_node import *
