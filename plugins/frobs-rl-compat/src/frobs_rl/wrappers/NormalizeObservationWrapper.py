"""Normalizes observations to [−1, 1]."""

from frobs_rl_compat.gym_api import KeepsApi
from frobs_rl_compat.wrappers import NormalizeObservationWrapper as _NormalizeObservationWrapper

__all__ = ["NormalizeObservWrapper", "NormalizeObservationWrapper"]


class NormalizeObservationWrapper(KeepsApi, _NormalizeObservationWrapper):
    """Version of :class:`frobs_rl_compat.wrappers.NormalizeObservationWrapper` that also supports the old gym API."""


NormalizeObservWrapper = NormalizeObservationWrapper  # alias, because FRobs_RL's documentation uses both names
