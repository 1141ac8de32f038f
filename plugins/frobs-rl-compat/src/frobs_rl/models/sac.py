"""Soft actor-critic."""

from frobs_rl_compat.models import AcceptsBothApis
from frobs_rl_compat.training import SAC as _SAC

__all__ = ["SAC"]


class SAC(AcceptsBothApis, _SAC):
    """Version of :class:`frobs_rl_compat.training.SAC` that also accepts environments with the old gym API."""
