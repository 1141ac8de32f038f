"""Description of the Universal Robots UR5 with a parallel gripper."""

from __future__ import annotations

from dataclasses import replace

from frobs_grippers import PARALLEL_GRIPPER
from frobs_robots_ur.ur5 import UR5

UR5_GRIPPER = replace(UR5.attach("tool0", PARALLEL_GRIPPER), name="ur5_gripper")
