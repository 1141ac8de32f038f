"""Train and resume."""
