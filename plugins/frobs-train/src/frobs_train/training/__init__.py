"""Train policies, and resume training runs."""
