"""Reaching tasks for FRobs."""
