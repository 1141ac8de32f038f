"""Settings of a search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from frobs_cli.field_options import option
from frobs_train.tuning.study import Pruner, Sampler

if TYPE_CHECKING:
    from frobs_train.configuration.config import RunConfig


@dataclass(frozen=True, kw_only=True)
class Search:
    """Settings of a search.

    Attributes:
        environment: Gymnasium ID. Defaults to the ID in the file.
        trials: Total number of trials in the study, including trials of earlier commands and other processes.
        file: YAML file with settings for every trial, with the keys of a run's ``config.yaml``.
        flags: Flags as in :func:`frobs_train.resolve_config`. ``seed`` is the first seed of each trial.
        settings: Fixed value for any setting, in the same form as for 'frobs train', such as
            algorithm_config.n_steps=16. Fixed settings are not searched. Repeatable.
        space: YAML file with the search space. Defaults to the algorithm's search space.
        folder: Folder for the runs and ``best.yaml``. Defaults to ``studies/<ID>/<algorithm>``.
        storage: Storage of the study: any storage URL that Optuna accepts. Defaults to the SQLite file ``study.db`` in the
            folder of the study.
        name: Name of the study in the storage. Defaults to ``<ID>/<algorithm>``.
        seeds: Number of runs per trial, each with its own seed. The seeds are consecutive.
        episodes: Number of evaluation episodes at the end of each run.
        metric: Metric to maximize. Defaults to success if the environment reports it, else to reward.
        sampler: Method that chooses the settings of each trial.
        pruner: Method that stops unpromising trials early. population replaces them with variants of better trials; it
            requires --runner ray.
    """

    environment: str | None = None
    trials: int = option(50, min=1)
    file: Path | str | None = option(None, name="config", exists=True, dir_okay=False)
    flags: Mapping[str, Any] = field(default_factory=dict)
    settings: Sequence[str] = option((), name="set", metavar="KEY=VALUE")
    space: Path | str | None = option(None, exists=True, dir_okay=False)
    folder: Path | str | None = option(None, name="study-dir", metavar="DIR")
    storage: str | None = option(None, metavar="URL")
    name: str | None = option(None)
    seeds: int = option(1, min=1)
    episodes: int = option(200, min=1)
    metric: Literal["success", "reward"] | None = option(None)
    sampler: Sampler = option("tpe")
    pruner: Pruner = option("median")

    def resolve(self, chosen: Mapping[str, Any] | None = None) -> RunConfig:
        """Return the configuration of a trial.

        ``chosen`` contains the trial's own settings, or is None for the configuration that all trials share.

        Raises:
            UnknownNameError: No algorithm has this name.
            ConfigurationError: A setting is unknown or invalid.
        """
        from frobs_train.configuration.resolve import resolve_config, write_setting  # the help needs no pydantic

        more = [write_setting(key, value) for key, value in (chosen or {}).items()]
        return resolve_config(
            self.environment,
            file=self.file,
            flags=self.flags,
            settings=[*self.settings, *more],
            check_parts=chosen is None,
        )
