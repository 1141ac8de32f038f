"""Franka Emika arms for FRobs."""
