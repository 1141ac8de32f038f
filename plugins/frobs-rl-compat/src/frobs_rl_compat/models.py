"""Mixin for FRobs_RL's algorithms, which accept environments with the old gym API or the Gymnasium API."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.manner import to_gymnasium


class AcceptsBothApis:
    """Mixin that lets an algorithm train on environments with the old gym API or the Gymnasium API."""

    def __init__(self, env: Any, *args: Any, **kwargs: Any) -> None:
        super().__init__(to_gymnasium(env), *args, **kwargs)  # type: ignore[call-arg]
