"""Start and stop nodes, the master and all processes of this process: the functions of :mod:`frobs_ros.ros_node`."""

from frobs_ros.ros_node import *
