"""Deep deterministic policy gradient."""

from frobs_algos_sb3.frobs_rl import DDPG as _DDPG
from frobs_rl_compat.models import AcceptsBothApis

__all__ = ["DDPG"]


class DDPG(AcceptsBothApis, _DDPG):
    """Version of :class:`frobs_algos_sb3.frobs_rl.DDPG` that also accepts environments with the old gym API."""
