"""The angles of the laser scanner are in degrees: its rays go round 57 times."""

from __future__ import annotations

from dataclasses import replace

from frobs_core.description import Lidar
from templates.my_rover import MY_ROVER

FAULTY = replace(
    MY_ROVER,
    sensors={
        "scan": Lidar(
            frame="base_link",
            offset=(0.0, 0.0, 0.2),
            rays=91,
            angle_min=-90.0,
            angle_max=90.0,
            range_min=0.1,
            range_max=8.0,
        )
    },
)
