"""Deep deterministic policy gradient."""

from frobs_rl_compat.models import AcceptsBothApis
from frobs_rl_compat.training import DDPG as _DDPG

__all__ = ["DDPG"]


class DDPG(AcceptsBothApis, _DDPG):
    """Version of :class:`frobs_rl_compat.training.DDPG` that also accepts environments with the old gym API."""
