"""Expands xacro files."""
