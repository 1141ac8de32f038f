"""Description of the Franka Emika Panda with a hand of the same size as the original hand."""

from __future__ import annotations

from dataclasses import replace

from frobs_grippers import TWO_FINGER_HAND
from frobs_robots_franka.panda_arm import PANDA_ARM

PANDA = replace(PANDA_ARM.attach("panda_tool0", TWO_FINGER_HAND), name="panda")
