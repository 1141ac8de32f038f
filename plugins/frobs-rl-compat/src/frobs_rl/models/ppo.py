"""Proximal policy optimization."""

from frobs_rl_compat.models import AcceptsBothApis
from frobs_rl_compat.training import PPO as _PPO

__all__ = ["PPO"]


class PPO(AcceptsBothApis, _PPO):
    """Version of :class:`frobs_rl_compat.training.PPO` that also accepts environments with the old gym API."""
