"""Random number generators."""

from frobs_rl_compat.old_gym.seeding import RandomNumberGenerator, np_random

__all__ = ["RandomNumberGenerator", "np_random"]
