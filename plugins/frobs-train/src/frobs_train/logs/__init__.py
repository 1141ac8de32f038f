"""Logs of a training run."""
