"""Soft actor-critic."""

from frobs_algos_sb3.frobs_rl import SAC as _SAC
from frobs_rl_compat.models import TakesBothManners

__all__ = ["SAC"]


class SAC(TakesBothManners, _SAC):
    """Soft actor-critic: :class:`frobs_algos_sb3.frobs_rl.SAC`."""
