"""Load, start, stop and reset controllers: the functions of :mod:`frobs_ros.ros_controllers`."""

from frobs_ros.ros_controllers import *
