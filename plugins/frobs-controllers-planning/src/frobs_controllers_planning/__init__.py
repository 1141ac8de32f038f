"""Planned motions for FRobs."""
