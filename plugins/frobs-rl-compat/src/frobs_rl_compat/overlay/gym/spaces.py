"""Gymnasium's spaces."""

from gymnasium.spaces import *
from gymnasium.spaces import __all__ as __all__
