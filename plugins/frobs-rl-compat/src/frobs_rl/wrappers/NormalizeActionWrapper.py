"""Normalizes actions to [−1, 1]."""

from frobs_core.wrappers import NormalizeActionWrapper as _NormalizeActionWrapper
from frobs_rl_compat.wrapping import KeepsApi

__all__ = ["NormalizeActionWrapper"]


class NormalizeActionWrapper(KeepsApi, _NormalizeActionWrapper):
    """:class:`frobs_core.wrappers.NormalizeActionWrapper`, for environments of both APIs."""
