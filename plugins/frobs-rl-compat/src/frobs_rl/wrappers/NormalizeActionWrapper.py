"""Normalizes actions to [−1, 1]."""

from frobs_core.wrappers import NormalizeActionWrapper as _NormalizeActionWrapper
from frobs_rl_compat.wrapping import KeepsApi

__all__ = ["NormalizeActionWrapper"]


class NormalizeActionWrapper(KeepsApi, _NormalizeActionWrapper):
    """Version of :class:`frobs_core.wrappers.NormalizeActionWrapper` that also supports the old gym API."""
