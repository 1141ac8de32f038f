"""Load YAML files into the parameter server: the functions of :mod:`frobs_ros.ros_params`."""

from frobs_ros.ros_params import *
