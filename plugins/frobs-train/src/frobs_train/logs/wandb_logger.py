"""Log to Weights & Biases, which reads environment variables such as WANDB_PROJECT, WANDB_ENTITY and WANDB_MODE."""

from __future__ import annotations

import os
import secrets
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from frobs_train.logs.services import Row, ServiceLogger, facts_of

if TYPE_CHECKING:
    from frobs_train.runs.run import Run


class WandbLogger(ServiceLogger):
    """Logger that sends the rows, configuration, versions and evaluations of a run to Weights & Biases.

    The name of the project is ``WANDB_PROJECT`` and defaults to ``frobs``. Runs of the same environment form a group.
    Weights & Biases writes its files to the run folder.
    """

    name: ClassVar[str] = "wandb"

    def _open(self, run: Run, state: Mapping[str, Any]) -> dict[str, Any]:
        import wandb

        config, versions = facts_of(run)
        id = state.get("id") or secrets.token_hex(8)
        self._service = wandb.init(
            id=id,
            resume="allow",
            reinit="create_new",
            project=os.environ.get("WANDB_PROJECT", "frobs"),
            name=run.path.name,
            group=run.config.environment,
            config={**config, "versions": versions},
            dir=run.path,
            settings=wandb.Settings(console="off"),
        )
        return {"id": id}

    def _log(self, rows: Sequence[Row]) -> None:
        for steps, values in rows:
            self._service.log(dict(values), step=steps)

    def _log_finals(self, steps: int, values: Mapping[str, float]) -> None:
        self._service.summary.update({**values, "final/steps": steps})

    def _close(self, *, complete: bool) -> None:
        self._service.finish(exit_code=0 if complete else 1)
