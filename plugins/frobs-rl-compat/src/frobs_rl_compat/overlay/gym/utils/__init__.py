"""Utilities for environments."""

from gymnasium.utils import EzPickle

from gym.utils import seeding

__all__ = ["EzPickle", "seeding"]
