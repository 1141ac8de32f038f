"""Evaluate, watch and record policies."""
