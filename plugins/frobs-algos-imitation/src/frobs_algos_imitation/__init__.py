"""Imitation learning: behavior cloning, DAgger and action chunking."""
