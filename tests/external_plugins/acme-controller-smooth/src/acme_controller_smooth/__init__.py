"""A controller that smooths its actions."""
