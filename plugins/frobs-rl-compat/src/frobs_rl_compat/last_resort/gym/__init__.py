"""A last resort for packages that import ``gym`` where no real one is installed: gym 0.21's names over Gymnasium.

``reset`` returns the observation, ``step`` four values. It is part of frobs-rl-compat, and gives way to a real ``gym``.
"""

from gym import envs, error, logger, spaces, utils, wrappers
from gym.core import ActionWrapper, Env, ObservationWrapper, RewardWrapper, Wrapper
from gym.envs.registration import make, register, spec
from gym.spaces import Space

__version__ = "0.21.0"
__all__ = [
    "ActionWrapper",
    "Env",
    "ObservationWrapper",
    "RewardWrapper",
    "Space",
    "Wrapper",
    "envs",
    "error",
    "logger",
    "make",
    "register",
    "spaces",
    "spec",
    "utils",
    "wrappers",
]


def __getattr__(name: str) -> object:
    raise AttributeError(
        f"this 'gym' is the last resort of frobs-rl-compat and has no '{name}'; import gymnasium, or install the gym that "
        "the package was written for."
    )
