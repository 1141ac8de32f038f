"""The three wrappers of FRobs_RL, usable with any Gymnasium environment."""

from frobs_core.wrappers.normalize_action import NormalizeActionWrapper
from frobs_core.wrappers.normalize_observation import NormalizeObservationWrapper
from frobs_core.wrappers.time_limit import TimeLimitWrapper

__all__ = ["NormalizeActionWrapper", "NormalizeObservationWrapper", "TimeLimitWrapper"]
