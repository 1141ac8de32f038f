"""Soft actor-critic."""

from frobs_algos_sb3.frobs_rl import SAC as _SAC
from frobs_rl_compat.models import AcceptsBothApis

__all__ = ["SAC"]


class SAC(AcceptsBothApis, _SAC):
    """Version of :class:`frobs_algos_sb3.frobs_rl.SAC` that also accepts environments with the old gym API."""
