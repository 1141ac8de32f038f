"""Start and stop nodes, the master and all processes that this one started: the functions of :mod:`frobs_ros.ros_node`."""

from frobs_ros.ros_node import *
