"""Limits the number of steps per episode."""

from frobs_rl_compat.gym_api import KeepsApi
from frobs_rl_compat.wrappers import TimeLimitWrapper as _TimeLimitWrapper

__all__ = ["TimeLimitWrapper"]


class TimeLimitWrapper(KeepsApi, _TimeLimitWrapper):
    """Version of :class:`frobs_rl_compat.wrappers.TimeLimitWrapper` that also supports the old gym API."""
