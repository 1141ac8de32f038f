"""Functions that load YAML files onto the ROS parameter server, re-exported from :mod:`frobs_rl_compat.ros.ros_params`."""

from frobs_rl_compat.ros.ros_params import *
