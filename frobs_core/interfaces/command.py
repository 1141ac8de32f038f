"""Command modes of joints."""

from __future__ import annotations

from enum import StrEnum


class CommandMode(StrEnum):
    """Meaning of a joint command: the target that the drive law follows."""

    POSITION = "position"
    VELOCITY = "velocity"
    EFFORT = "effort"
