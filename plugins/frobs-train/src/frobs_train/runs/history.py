"""Record the configuration of a run and its changes in ``history.json``.

``config.yaml`` contains the same configuration in human-readable form. If ``config.yaml`` is edited, resuming the run
applies the edits as changes. All other functions use the recorded configuration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from frobs_core.kernel.config import KEYWORDS
from frobs_core.util.errors import ConfigurationError, RunError
from frobs_core.util.files import read_json, write_json, write_text
from frobs_core.util.plain import plain, read_numbers, spell_numbers
from frobs_core.util.validation import validate
from frobs_core.util.yaml import dump_yaml
from frobs_train.configuration.config import RunConfig, differences

FILE = "history.json"

_FIXED = {
    "environment": "the policy was trained in this environment",
    "randomize": "the checkpoints contain environments that were randomized with these settings",
    "algorithm": "the checkpoints contain the networks of the original algorithm",
    "reset_from": "the checkpoints contain episodes that began with this setting",
    "stagger": "the checkpoints contain episodes that began with this setting",
    "algorithm_config": "the checkpoints contain networks and an optimizer that were built with these settings",
    "num_envs": "the checkpoints contain the state of this number of environments",
    "seed": "all random numbers of the run depend on the seed",
    "wrappers": "the policy was trained with these wrappers",
    "threads.torch": "a different number of threads may lead to different rounding errors in the algorithm",
}
"""Configuration keys that cannot change during a run, with the reason for each key."""

_PART = "the policy and the checkpoints depend on this setting"


class _Setting(BaseModel):
    before: Any = Field(alias="from")
    after: Any = Field(alias="to")


class _Change(BaseModel):
    model_config = ConfigDict(extra="allow")

    steps: Annotated[int, Field(ge=0)]
    settings: dict[str, _Setting]


class _History(BaseModel):
    config: RunConfig
    changes: list[_Change]


def check_change(before: RunConfig, after: RunConfig, source: str) -> None:
    """Raise RunError if a setting that cannot change during a run differs between two configurations.

    Error messages name the ``source`` of the new configuration, such as ``"--set"``.
    """
    for key, old, new in differences(before.model_dump(), after.model_dump()):
        section, _, rest = key.partition(".")
        reason = _FIXED.get(key, _FIXED.get(section))
        if section == "environment_kwargs" and rest.partition(".")[0] in KEYWORDS - {"num_threads"}:
            reason = _PART
        if reason is not None:
            raise RunError(
                f"{source}: {key} cannot change from {old!r} to {new!r} in this run, because {reason}. "
                "Start a new run with 'frobs train'."
            )


def write_history(folder: Path, config: RunConfig, changes: Sequence[Mapping[str, Any]] = ()) -> None:
    """Write a configuration to ``config.yaml``, then the configuration and its changes to ``history.json``."""
    values = plain(config.model_dump(), for_yaml=True)
    write_text(folder / "config.yaml", dump_yaml(values))
    write_json(folder / FILE, spell_numbers({"config": values, "changes": list(changes)}))


def has_history(folder: Path) -> bool:
    """Return whether a run folder contains ``history.json``. FRobs versions before 0.2 did not write this file."""
    return (folder / FILE).is_file()


def read_history(folder: Path) -> tuple[RunConfig | None, tuple[Mapping[str, Any], ...]]:
    """Return the configuration of a run and its changes.

    The configuration is None if the run was created by a version of FRobs that did not write ``history.json``.
    """
    path = folder / FILE
    try:
        history = validate(_History, read_numbers(read_json(path)), str(path))
    except FileNotFoundError:
        return None, ()
    except (OSError, ConfigurationError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise RunError(f"{path} cannot be read: {reason}; remove this file to use config.yaml instead.") from error
    return history.config, tuple(change.model_dump(by_alias=True) for change in history.changes)


def describe_change(before: RunConfig, after: RunConfig, steps: int) -> dict[str, Any]:
    """Return a record of the changed settings and of the environment steps completed before the change."""
    changes = differences(before.model_dump(), after.model_dump())
    return {
        "steps": steps,
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "settings": {
            key: {"from": plain(old, for_yaml=True), "to": plain(new, for_yaml=True)} for key, old, new in changes
        },
    }
