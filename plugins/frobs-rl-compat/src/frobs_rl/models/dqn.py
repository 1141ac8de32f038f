"""Deep Q-network."""

from frobs_rl_compat.models import AcceptsBothApis
from frobs_rl_compat.training import DQN as _DQN

__all__ = ["DQN"]


class DQN(AcceptsBothApis, _DQN):
    """Version of :class:`frobs_rl_compat.training.DQN` that also accepts environments with the old gym API."""
