"""Group runs that differ only in their seed, and label each group by its distinguishing settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from frobs_core.util.plain import spell_numbers, to_json
from frobs_train.runs.run import Run

_OF_LOGS = ("log_every", "checkpoint_every", "keep_checkpoints", "evaluate_every", "evaluation_episodes", "log")
_INDIFFERENT = ("seed", "threads", *_OF_LOGS)
"""Settings that do not distinguish groups: the seed, and settings that do not affect learning."""

_SPOKEN = ("environment", "algorithm")  # settings whose values appear in a label without the name of the setting
_MOST = 3
"""Maximum number of settings in a label. If more settings differ, the label shows the name of a run folder instead."""


def group_runs(runs: Sequence[Run]) -> dict[str, list[Run]]:
    """Group runs by environment, algorithm and all settings except the seed.

    Settings that do not affect learning are also ignored. Each key of the result is the label of a group. A label
    consists of the environment, the algorithm, and the settings that distinguish the group from other groups with the
    same environment and algorithm, for example ``"CartPole-v1 · PPO · learning_rate=0.001"``.
    """
    gathered: dict[str, list[Run]] = {}
    for run in runs:
        gathered.setdefault(to_json(spell_numbers(_identity(run)), sort_keys=True), []).append(run)
    groups = list(gathered.values())
    settings = [_flat(_identity(members[0])) for members in groups]
    labelled: dict[str, list[Run]] = {}
    for index, members in enumerate(groups):
        label = _label(settings, index, members[0])
        labelled[label if label not in labelled else f"{label} ({members[0].path})"] = members
    return labelled


def _identity(run: Run) -> dict[str, Any]:
    return {key: value for key, value in run.config.model_dump(mode="json").items() if key not in _INDIFFERENT}


def _label(settings: Sequence[Mapping[str, Any]], index: int, run: Run) -> str:
    mine = settings[index]
    rivals = [other for other in settings if all(other[key] == mine[key] for key in _SPOKEN)]
    keys = {key: None for other in rivals for key in other}
    differing = [key for key in keys if any(other.get(key) != mine.get(key) for other in rivals)]
    controller = mine.get("environment_kwargs.controller")
    parts = [str(mine["environment"]).rpartition(":")[2], str(mine["algorithm"]).upper()]
    if controller and "environment_kwargs.controller" not in differing:
        parts.append(str(controller))
    if len(differing) > _MOST:
        return " · ".join([*parts, run.path.name])
    return " · ".join([*parts, *(f"{_short(key, keys)}={_text(mine.get(key))}" for key in differing)])


def _flat(mapping: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in mapping.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _short(key: str, keys: Mapping[str, Any]) -> str:
    """Return the last part of a dotted key, or the whole key if another key has the same last part."""
    last = key.rpartition(".")[2]
    return last if sum(other.rpartition(".")[2] == last for other in keys) == 1 else key


def _text(value: Any) -> str:
    if value is None:
        return "default"
    if isinstance(value, float):
        return f"{value:g}"
    return str(value)
