"""Evaluating, playing and filming policies."""
