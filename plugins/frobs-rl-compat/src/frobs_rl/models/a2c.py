"""Advantage actor-critic."""

from frobs_rl_compat.training import A2C

__all__ = ["A2C"]
