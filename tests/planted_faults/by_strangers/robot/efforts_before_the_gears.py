"""The effort limits are those of the motors, before the gears, so that the arm cannot carry its own weight."""

from __future__ import annotations

from dataclasses import replace

from frobs_robots_abb.irb120 import IRB120

_GEAR_RATIO = 100.0

FAULTY = replace(IRB120, xacro_args={"effort": str(1000.0 / _GEAR_RATIO)})
