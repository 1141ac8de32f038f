"""Functions that launch Gazebo and call its services, re-exported from :mod:`frobs_rl_compat.ros.ros_gazebo`."""

from frobs_rl_compat.ros.ros_gazebo import *
