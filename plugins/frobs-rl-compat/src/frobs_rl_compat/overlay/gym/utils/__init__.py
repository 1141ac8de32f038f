"""What environments use."""

from gymnasium.utils import EzPickle

from gym.utils import seeding

__all__ = ["EzPickle", "seeding"]
