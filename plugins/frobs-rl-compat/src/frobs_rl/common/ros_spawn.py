"""Functions that spawn a robot with its controllers, re-exported from :mod:`frobs_rl_compat.ros.ros_spawn`."""

from frobs_rl_compat.ros.ros_spawn import *
