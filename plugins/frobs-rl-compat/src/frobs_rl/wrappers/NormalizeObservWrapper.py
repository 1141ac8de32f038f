"""Normalizes observations to [−1, 1]: the second name of the wrapper in FRobs_RL's documentation."""

from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper, NormalizeObservWrapper

__all__ = ["NormalizeObservWrapper", "NormalizeObservationWrapper"]
