"""Command modes of joints."""

from __future__ import annotations

from enum import StrEnum


class CommandMode(StrEnum):
    """Quantity that a joint command specifies as the target of the drive law."""

    POSITION = "position"
    VELOCITY = "velocity"
    EFFORT = "effort"
