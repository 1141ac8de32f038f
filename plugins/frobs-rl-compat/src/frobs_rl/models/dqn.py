"""Deep Q-network."""

from frobs_algos_sb3.frobs_rl import DQN as _DQN
from frobs_rl_compat.models import AcceptsBothApis

__all__ = ["DQN"]


class DQN(AcceptsBothApis, _DQN):
    """Version of :class:`frobs_algos_sb3.frobs_rl.DQN` that also accepts environments with the old gym API."""
