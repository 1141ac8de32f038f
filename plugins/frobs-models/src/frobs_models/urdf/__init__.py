"""Reads URDF files."""
