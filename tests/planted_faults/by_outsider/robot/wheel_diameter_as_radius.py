"""The differential drive receives the diameter of the wheels as their radius: the rover drives half as fast as it says."""

from __future__ import annotations

from dataclasses import replace

from templates.my_rover import MY_ROVER

FAULTY = replace(MY_ROVER, differential_drive=replace(MY_ROVER.differential_drive, wheel_radius=0.12))
