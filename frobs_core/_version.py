"""Version of the core, in its own module to avoid circular imports."""

__version__ = "0.3.0"
