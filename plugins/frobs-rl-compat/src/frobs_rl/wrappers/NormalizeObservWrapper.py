"""Alias of ``NormalizeObservationWrapper``, because FRobs_RL's documentation uses both spellings."""

from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper, NormalizeObservWrapper

__all__ = ["NormalizeObservWrapper", "NormalizeObservationWrapper"]
