"""Compare runs across seeds."""
