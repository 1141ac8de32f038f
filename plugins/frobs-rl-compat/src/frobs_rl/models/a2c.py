"""Advantage actor-critic."""

from frobs_rl_compat.models import AcceptsBothApis
from frobs_rl_compat.training import A2C as _A2C

__all__ = ["A2C"]


class A2C(AcceptsBothApis, _A2C):
    """Version of :class:`frobs_rl_compat.training.A2C` that also accepts environments with the old gym API."""
