"""Functions that spawn a robot with its controllers, re-exported from :mod:`frobs_ros.ros_spawn`."""

from frobs_ros.ros_spawn import *
