"""The left wheel is named as the right one: the rover turns right where it shall turn left."""

from __future__ import annotations

from dataclasses import replace

from templates.my_rover import MY_ROVER

FAULTY = replace(
    MY_ROVER,
    differential_drive=replace(MY_ROVER.differential_drive, left=("right_wheel_joint",), right=("left_wheel_joint",)),
)
