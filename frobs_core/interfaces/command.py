"""What a joint command means."""

from __future__ import annotations

from enum import StrEnum


class CommandMode(StrEnum):
    """What a joint command means: the target of the drive law."""

    POSITION = "position"
    VELOCITY = "velocity"
    EFFORT = "effort"
