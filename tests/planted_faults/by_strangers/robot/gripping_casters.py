"""The casters keep the simulator's default friction instead of gliding, so they brake the robot, and it drives and turns too slowly."""

from __future__ import annotations

from dataclasses import replace

from frobs_robots_kobuki.kobuki import KOBUKI

FAULTY = replace(KOBUKI, friction={})
