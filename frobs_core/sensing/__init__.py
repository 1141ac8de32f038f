"""Sensors, and randomization of physics, commands and observations."""
