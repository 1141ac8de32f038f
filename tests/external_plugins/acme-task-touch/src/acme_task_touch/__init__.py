"""A task: touch a point on a table."""
