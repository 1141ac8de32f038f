"""Mixin for FRobs_RL's wrappers, which keep the API of the wrapped environment."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.manner import forwarded, has_gym_api, to_four_values, to_gymnasium


class KeepsApi:
    """Mixin that makes a Gymnasium wrapper support the old gym API and keep the API of the wrapped environment.

    Args:
        env: The environment to wrap, whose attributes are accessible through the wrapper.
    """

    def __init__(self, env: Any, *args: Any, **kwargs: Any) -> None:
        self.has_gym_api = has_gym_api(env)
        super().__init__(to_gymnasium(env), *args, **kwargs)  # type: ignore[call-arg]

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode."""
        observation, info = super().reset(**kwargs)  # type: ignore[misc]
        return observation if self.has_gym_api else (observation, info)

    def step(self, action: Any) -> Any:
        """Execute an action."""
        answer = super().step(action)  # type: ignore[misc]
        return to_four_values(answer) if self.has_gym_api else answer

    def __getattr__(self, name: str) -> Any:
        return forwarded(self, name)
