"""Advantage actor-critic."""

from frobs_rl_compat.training import A2C as A2C
