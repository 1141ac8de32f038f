"""FRobs_RL's wrappers answer as what they wrap."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.manner import answer_reset, answer_step, forwarded, manner_of, to_gymnasium


class AnswersAsWrapped:
    """Makes a wrapper of Gymnasium one for both manners: it works in Gymnasium's, and answers in that of what it wraps.

    Args:
        env: The environment. Its attributes can be read through the wrapper.
        *args: Of the wrapper.
        **kwargs: Of the wrapper.
    """

    def __init__(self, env: Any, *args: Any, **kwargs: Any) -> None:
        self.frobs_manner = manner_of(env)
        super().__init__(to_gymnasium(env), *args, **kwargs)

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode."""
        return answer_reset(self.frobs_manner, super().reset(**kwargs))  # type: ignore[misc]

    def step(self, action: Any) -> Any:
        """Act."""
        return answer_step(self.frobs_manner, super().step(action))  # type: ignore[misc]

    def __getattr__(self, name: str) -> Any:
        return forwarded(self, name)
