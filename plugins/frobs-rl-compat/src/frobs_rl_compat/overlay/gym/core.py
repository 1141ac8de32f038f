"""Environments and wrappers."""

from frobs_rl_compat.old_gym.core import ActionWrapper, Env, ObservationWrapper, RewardWrapper, Wrapper

__all__ = ["ActionWrapper", "Env", "ObservationWrapper", "RewardWrapper", "Wrapper"]
