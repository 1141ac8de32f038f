"""Advice on a configuration, for the command line."""

from __future__ import annotations

from frobs_core.plugins.registry import bare_id, environments
from frobs_train.configuration.config import RunConfig
from frobs_train.configuration.resolve import resolve_config


def advise_controller(config: RunConfig) -> str | None:
    """Return a hint if the ID's default controller needs fewer training steps than the chosen controller, else None.

    The step counts are taken from the tuned settings.
    """
    id, chosen = bare_id(config.environment), config.environment_kwargs.get("controller")
    if id not in environments() or not isinstance(chosen, str):
        return None
    own = environments()[id][1].controller
    steps = {
        name: resolve_config(id, flags={"algorithm": config.algorithm, "controller": name}).steps
        for name in (own, chosen)
    }
    if steps[own] >= steps[chosen]:
        return None
    return (
        f"Training is faster with '--controller {own}', which needs {steps[own]:,} steps; '{chosen}' needs "
        f"{steps[chosen]:,}."
    )
