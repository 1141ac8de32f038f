"""Algorithms of stable-baselines3 for FRobs."""
