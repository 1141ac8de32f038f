"""FRobs_RL's algorithms, for environments of both APIs."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.manner import to_gymnasium


class AcceptsBothApis:
    """Mixin for an algorithm that trains on environments with old gym's API or Gymnasium's."""

    def __init__(self, env: Any, *args: Any, **kwargs: Any) -> None:
        super().__init__(to_gymnasium(env), *args, **kwargs)  # type: ignore[call-arg]
