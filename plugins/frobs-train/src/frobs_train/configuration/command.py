"""Find the command that reproduces a run's configuration."""

from __future__ import annotations

import shlex
from typing import Any

from frobs_core.util.errors import FrobsError
from frobs_train.configuration.config import RunConfig, differences
from frobs_train.configuration.resolve import resolve_config, usual_algorithm, write_num_envs, write_setting

_OF_THE_ENVIRONMENT = ("robot", "attach", "tcp", "base", "simulator", "controller", "object")
_FLAGS = ("num_envs", "steps")


def training_command(config: RunConfig) -> str | None:
    """Return the shortest ``frobs train`` command that resolves to a configuration.

    Return None if there is none, for example because tuned settings or installed packages have changed.
    """
    flags: dict[str, Any] = {"algorithm": config.algorithm, "seed": config.seed}
    words = ["frobs", "train", config.environment]
    if config.algorithm != usual_algorithm(config.environment):
        words += ["--algorithm", config.algorithm]
    try:
        usual = resolve_config(config.environment, flags=flags)
        for name in _OF_THE_ENVIRONMENT:
            value = config.environment_kwargs.get(name)
            if isinstance(value, str) and value != usual.environment_kwargs.get(name):
                flags[name] = value
                words += [f"--{name}", value]
        usual = resolve_config(config.environment, flags=flags)
        for name in _FLAGS:
            if getattr(config, name) != getattr(usual, name):
                flags[name] = getattr(config, name)
                text = write_num_envs(flags[name]) if name == "num_envs" else str(flags[name])
                words += [f"--{name.replace('_', '-')}", text]
        usual = resolve_config(config.environment, flags=flags)
        changes = differences(usual.model_dump(), config.model_dump())
        settings = [write_setting(key, value) for key, _, value in changes]
        if resolve_config(config.environment, flags=flags, settings=settings) != config:
            return None
    except FrobsError:
        return None
    if config.seed is not None:
        words += ["--seed", str(config.seed)]
    return shlex.join([*words, *(word for setting in settings for word in ("--set", setting))])
