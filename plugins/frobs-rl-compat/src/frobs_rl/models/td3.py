"""Twin delayed deep deterministic policy gradient (TD3)."""

from frobs_algos_sb3.frobs_rl import TD3 as _TD3
from frobs_rl_compat.models import AcceptsBothApis

__all__ = ["TD3"]


class TD3(AcceptsBothApis, _TD3):
    """Version of :class:`frobs_algos_sb3.frobs_rl.TD3` that also accepts environments with the old gym API."""
