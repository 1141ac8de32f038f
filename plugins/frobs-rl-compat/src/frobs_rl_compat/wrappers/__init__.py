"""The three wrappers of FRobs_RL, usable with any Gymnasium environment."""

from frobs_rl_compat.wrappers.normalization import NormalizeActionWrapper, NormalizeObservationWrapper
from frobs_rl_compat.wrappers.time_limit import TimeLimitWrapper

__all__ = ["NormalizeActionWrapper", "NormalizeObservationWrapper", "TimeLimitWrapper"]
