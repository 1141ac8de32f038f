"""The base class for algorithms."""

from frobs_rl_compat.training import BasicModel as BasicModel
