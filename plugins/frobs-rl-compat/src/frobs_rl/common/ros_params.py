"""Functions that load YAML files onto the ROS parameter server, re-exported from :mod:`frobs_ros.ros_params`."""

from frobs_ros.ros_params import *
