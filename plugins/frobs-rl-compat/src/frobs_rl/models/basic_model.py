"""The base class for algorithms."""

from frobs_rl_compat.training import BasicModel

__all__ = ["BasicModel"]
