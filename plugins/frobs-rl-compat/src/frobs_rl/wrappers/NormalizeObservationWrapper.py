"""Observations in [−1, 1]."""

from frobs_core.wrappers import NormalizeObservationWrapper as _NormalizeObservationWrapper
from frobs_rl_compat.wrapping import AnswersAsWrapped

__all__ = ["NormalizeObservWrapper", "NormalizeObservationWrapper"]


class NormalizeObservationWrapper(AnswersAsWrapped, _NormalizeObservationWrapper):
    """:class:`frobs_core.wrappers.NormalizeObservationWrapper`, over environments of either manner."""


NormalizeObservWrapper = NormalizeObservationWrapper  # FRobs_RL's documentation has both names
