"""Reads MJCF files."""
