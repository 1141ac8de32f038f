"""Twin delayed deep deterministic policy gradient (TD3)."""

from frobs_rl_compat.models import AcceptsBothApis
from frobs_rl_compat.training import TD3 as _TD3

__all__ = ["TD3"]


class TD3(AcceptsBothApis, _TD3):
    """Version of :class:`frobs_rl_compat.training.TD3` that also accepts environments with the old gym API."""
