"""Gymnasium's log messages."""

from gymnasium.logger import deprecation, error, warn

__all__ = ["deprecation", "error", "set_level", "warn"]

DEBUG, INFO, WARN, ERROR, DISABLED = 10, 20, 30, 40, 50


def set_level(level: int) -> None:
    """Set the minimum level at which messages are printed."""
    from gymnasium import logger

    logger.min_level = level
