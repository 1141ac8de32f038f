"""Functions that load, start, stop and reset controllers; see :mod:`frobs_rl_compat.ros.ros_controllers`."""

from frobs_rl_compat.ros.ros_controllers import *
