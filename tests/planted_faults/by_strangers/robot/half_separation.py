"""The separation of the wheels is the distance from the robot's middle to a wheel."""

from __future__ import annotations

from dataclasses import replace

from frobs_robots_kobuki.kobuki import KOBUKI

_WHEEL_Y = 0.115  # [m]

FAULTY = replace(KOBUKI, differential_drive=replace(KOBUKI.differential_drive, separation=_WHEEL_Y))
