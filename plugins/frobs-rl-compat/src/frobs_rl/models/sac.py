"""Soft actor-critic."""

from frobs_rl_compat.training import SAC as SAC
