"""Deep deterministic policy gradient."""

from frobs_rl_compat.training import DDPG

__all__ = ["DDPG"]
