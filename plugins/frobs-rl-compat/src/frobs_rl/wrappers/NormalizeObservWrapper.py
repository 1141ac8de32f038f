"""Alias of ``NormalizeObservationWrapper``, provided because FRobs_RL's documentation uses both names."""

from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper, NormalizeObservWrapper

__all__ = ["NormalizeObservWrapper", "NormalizeObservationWrapper"]
