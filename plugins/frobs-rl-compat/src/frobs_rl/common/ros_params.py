"""Functions that load YAML files into ROS's parameter server, re-exported from :mod:`frobs_ros.ros_params`."""

from frobs_ros.ros_params import *
