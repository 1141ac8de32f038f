"""Stable-baselines3 algorithms for FRobs."""

from frobs_core.deprecation import MOVED

MOVED["frobs_algos_sb3.frobs_rl"] = ["frobs_rl_compat.training"]
