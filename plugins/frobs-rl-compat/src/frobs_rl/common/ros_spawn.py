"""Spawn a robot with its controllers: the functions of :mod:`frobs_ros.ros_spawn`."""

from frobs_ros.ros_spawn import *
from frobs_ros.ros_spawn import __all__ as __all__
