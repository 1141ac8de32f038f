"""Gymnasium's errors."""

from gymnasium.error import *
