"""Functions that load YAML files onto the ROS parameter server; see :mod:`frobs_rl_compat.ros.ros_params`."""

from frobs_rl_compat.ros.ros_params import *
