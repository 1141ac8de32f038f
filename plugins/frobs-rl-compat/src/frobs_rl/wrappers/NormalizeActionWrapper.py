"""Normalizes actions to [−1, 1]."""

from frobs_rl_compat.wrappers import NormalizeActionWrapper as _NormalizeActionWrapper
from frobs_rl_compat.wrapping import KeepsApi

__all__ = ["NormalizeActionWrapper"]


class NormalizeActionWrapper(KeepsApi, _NormalizeActionWrapper):
    """Version of :class:`frobs_rl_compat.wrappers.NormalizeActionWrapper` that also supports the old gym API."""
