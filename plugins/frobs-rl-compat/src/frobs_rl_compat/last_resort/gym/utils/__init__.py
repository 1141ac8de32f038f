"""What environments use."""

from gym.utils import seeding
from gymnasium.utils import EzPickle

__all__ = ["EzPickle", "seeding"]
