"""FRobs_RL's algorithms train on environments of both manners."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.manner import to_gymnasium


class TakesBothManners:
    """Gives an algorithm its environment in Gymnasium's manner, whatever it answers to others.

    Args:
        env: An environment, a vector environment of stable-baselines3, or None where a model is opened for predictions.
        *args: Of the algorithm.
        **kwargs: Of the algorithm.
    """

    def __init__(self, env: Any, *args: Any, **kwargs: Any) -> None:
        super().__init__(to_gymnasium(env), *args, **kwargs)
