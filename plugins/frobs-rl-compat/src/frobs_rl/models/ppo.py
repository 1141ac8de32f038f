"""Proximal policy optimization."""

from frobs_algos_sb3.frobs_rl import PPO as _PPO
from frobs_rl_compat.models import AcceptsBothApis

__all__ = ["PPO"]


class PPO(AcceptsBothApis, _PPO):
    """Version of :class:`frobs_algos_sb3.frobs_rl.PPO` that also accepts environments with the old gym API."""
