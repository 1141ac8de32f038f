"""Comparing runs over seeds."""
