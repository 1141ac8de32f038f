"""Proximal policy optimization."""

from frobs_rl_compat.training import PPO as PPO
