"""Algorithms of sbx for FRobs: those of stable-baselines3 in JAX."""
