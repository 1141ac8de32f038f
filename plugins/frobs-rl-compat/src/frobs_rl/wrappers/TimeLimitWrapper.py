"""A limit of steps per episode."""

from frobs_core.wrappers import TimeLimitWrapper as _TimeLimitWrapper
from frobs_rl_compat.wrapping import AnswersAsWrapped

__all__ = ["TimeLimitWrapper"]


class TimeLimitWrapper(AnswersAsWrapped, _TimeLimitWrapper):
    """:class:`frobs_core.wrappers.TimeLimitWrapper`, over environments of either manner."""
