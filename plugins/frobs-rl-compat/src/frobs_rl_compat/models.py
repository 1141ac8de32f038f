"""FRobs_RL's algorithms train on environments of both APIs."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.manner import to_gymnasium


class AcceptsBothApis:
    """Mixin for an algorithm: trains on environments of old gym's API and of Gymnasium's.

    Args:
        env: An environment, a vector environment of stable-baselines3, or None where a model is opened for predictions.
        *args: Positional arguments of the algorithm.
        **kwargs: Keyword arguments of the algorithm.
    """

    def __init__(self, env: Any, *args: Any, **kwargs: Any) -> None:
        super().__init__(to_gymnasium(env), *args, **kwargs)
