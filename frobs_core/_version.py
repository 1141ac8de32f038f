"""The version of the core, where every module of it can import it."""

__version__ = "0.2.0"
