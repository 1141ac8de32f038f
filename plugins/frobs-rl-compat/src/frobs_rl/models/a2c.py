"""Advantage actor-critic."""

from frobs_algos_sb3.frobs_rl import A2C as _A2C
from frobs_rl_compat.models import AcceptsBothApis

__all__ = ["A2C"]


class A2C(AcceptsBothApis, _A2C):
    """Version of :class:`frobs_algos_sb3.frobs_rl.A2C` that also accepts environments with the old gym API."""
