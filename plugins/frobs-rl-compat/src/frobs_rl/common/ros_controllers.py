"""Functions that load, start, stop and reset controllers, re-exported from :mod:`frobs_ros.ros_controllers`."""

from frobs_ros.ros_controllers import *
