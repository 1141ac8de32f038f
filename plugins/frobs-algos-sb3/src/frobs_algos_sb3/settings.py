"""Building blocks of settings: those of all algorithm plugins, and one of stable-baselines3."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from frobs_algos.settings import Fraction, Schedule, Settings, schedule

__all__ = ["Fraction", "SampleFrequency", "Schedule", "Settings", "schedule"]

SampleFrequency = Annotated[int, Field(ge=-1)]
"""Number of steps after which gSDE draws a new noise matrix, or −1 to draw one only at the start of an iteration."""
