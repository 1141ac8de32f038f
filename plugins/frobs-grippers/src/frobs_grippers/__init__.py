"""Grippers and other end effectors for FRobs."""
