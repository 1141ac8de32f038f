"""Manipulation tasks for FRobs."""
