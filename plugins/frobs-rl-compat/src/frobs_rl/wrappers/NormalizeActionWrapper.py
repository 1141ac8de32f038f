"""Normalizes actions to [−1, 1]."""

from frobs_rl_compat.gym_api import KeepsApi
from frobs_rl_compat.wrappers import NormalizeActionWrapper as _NormalizeActionWrapper

__all__ = ["NormalizeActionWrapper"]


class NormalizeActionWrapper(KeepsApi, _NormalizeActionWrapper):
    """Version of :class:`frobs_rl_compat.wrappers.NormalizeActionWrapper` that also supports the old gym API."""
