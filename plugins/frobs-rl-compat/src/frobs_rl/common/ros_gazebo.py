"""Functions that launch Gazebo and call its services, re-exported from :mod:`frobs_ros.ros_gazebo`."""

from frobs_ros.ros_gazebo import *
