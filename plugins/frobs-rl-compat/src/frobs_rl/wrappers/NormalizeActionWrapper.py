"""Actions in [−1, 1]."""

from frobs_core.wrappers import NormalizeActionWrapper as _NormalizeActionWrapper
from frobs_rl_compat.wrapping import AnswersAsWrapped

__all__ = ["NormalizeActionWrapper"]


class NormalizeActionWrapper(AnswersAsWrapped, _NormalizeActionWrapper):
    """:class:`frobs_core.wrappers.NormalizeActionWrapper`, over environments of either manner."""
