"""Translates FRobs_RL's YAML files into run configurations, for ``frobs train --config``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from frobs_core.util.errors import ConfigFileError
from frobs_rl_compat.training.settings import ROOT, read_settings

_ELSEWHERE = (
    *("save_prefix", "trained_model_name", "save_replay_buffer", "load_model", "model_name"),
    *("log_folder", "log_interval", "reset_num_timesteps"),
)
"""Keys that have no effect on a run, because a run chooses its own file names and logs."""


def translate(mapping: Mapping[str, Any], algorithm: str, path: Path) -> tuple[dict[str, Any], str]:
    """Return the :class:`frobs_train.RunConfig` settings that correspond to a FRobs_RL file, and a note.

    The note is one line that lists the keys that have no effect on a run, or is empty if there are no such keys. A
    ConfigFileError is raised if a key or value is invalid, or if the file continues a saved model.
    """
    settings = read_settings(mapping, algorithm, path)
    params = settings.params
    if params.load_model:
        raise ConfigFileError(
            path,
            None,
            "load_model is not supported here, because a run always starts with a new model; set load_model to False, "
            f"or continue the saved model with the class frobs_rl_compat.training.{algorithm.upper()}.",
        )
    config: dict[str, Any] = {"algorithm": algorithm, "num_envs": 1, "steps": params.training_steps}
    if params.save_freq:
        config["checkpoint_every"] = params.save_freq
    config["algorithm_config"] = settings.run_settings()
    unused = [key for key in mapping[ROOT] if key in (*_ELSEWHERE, *settings.unused)]
    note = (
        f"{path}: a run chooses its own file names and logs, so these keys have no effect: {', '.join(unused)}."
        if unused
        else ""
    )
    return config, note
