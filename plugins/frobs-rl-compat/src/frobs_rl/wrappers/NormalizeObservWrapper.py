"""Observations in [−1, 1], under the other name that FRobs_RL's documentation has for it."""

from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper, NormalizeObservWrapper

__all__ = ["NormalizeObservWrapper", "NormalizeObservationWrapper"]
