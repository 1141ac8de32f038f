"""A learning algorithm: hill climbing."""
