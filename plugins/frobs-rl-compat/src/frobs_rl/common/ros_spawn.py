"""Spawn a robot with its controllers: the functions of :mod:`frobs_ros.ros_spawn`."""

from frobs_ros.ros_spawn import *
