"""Deprecated name of :mod:`frobs_rl_compat.gym_api`."""

from frobs_core.deprecation import moved_names

__getattr__ = moved_names(__name__, ["frobs_rl_compat.gym_api"])
