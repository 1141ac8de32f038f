"""Stable-baselines3 algorithms for FRobs."""
