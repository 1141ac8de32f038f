"""The ``gym`` package for 'frobs legacy run': gym 0.21's names and API, implemented with Gymnasium.

``reset`` returns only the observation, and ``step`` returns four values.
"""

from gym import envs, error, logger, spaces, utils, wrappers
from gym.core import ActionWrapper, Env, ObservationWrapper, RewardWrapper, Wrapper
from gym.envs.registration import make, register, spec
from gym.spaces import Space

__version__ = "0.21.0"
__all__ = [
    "ActionWrapper", "Env", "ObservationWrapper", "RewardWrapper", "Space", "Wrapper", "envs", "error", "logger",
    "make", "register", "spaces", "spec", "utils", "wrappers",
]  # fmt: skip


def __getattr__(name: str) -> object:
    raise AttributeError(
        f"the 'gym' module of 'frobs legacy run' has no attribute '{name}'; change the package to import gymnasium "
        "instead."
    )
