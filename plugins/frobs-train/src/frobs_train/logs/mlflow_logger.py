"""Log to MLflow, which reads environment variables such as MLFLOW_TRACKING_URI and MLFLOW_EXPERIMENT_NAME."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from frobs_cli.facts import dotted
from frobs_train.logs.services import Row, ServiceLogger, facts_of

if TYPE_CHECKING:
    from frobs_train.runs.run import Run

_MOST_PARAMS, _MOST_METRICS, _LONGEST_PARAM = 100, 1000, 6000
"""Limits of MLflow: parameters per request, metrics per request, and characters per parameter."""


class MlflowLogger(ServiceLogger):
    """Logger that sends a run to MLflow.

    Rows and evaluations are sent as metrics, the configuration as parameters, and the versions as tags. The name of the
    experiment is ``MLFLOW_EXPERIMENT_NAME`` and defaults to ``frobs``. A resumed run uses its original tracking URI
    unless ``MLFLOW_TRACKING_URI`` is set.
    """

    name: ClassVar[str] = "mlflow"

    def _open(self, run: Run, state: Mapping[str, Any]) -> dict[str, Any]:
        from mlflow import MlflowClient
        from mlflow.entities import Param, RunTag

        uri = None if "MLFLOW_TRACKING_URI" in os.environ else state.get("tracking_uri")
        self._client = MlflowClient(tracking_uri=uri)
        self._id = str(state.get("id", ""))
        if self._id:
            self._client.update_run(self._id, status="RUNNING")
        else:
            config, versions = facts_of(run)
            experiment = os.environ.get("MLFLOW_EXPERIMENT_NAME", "frobs")
            existing = self._client.get_experiment_by_name(experiment)
            experiment_id = existing.experiment_id if existing else self._client.create_experiment(experiment)
            self._id = self._client.create_run(experiment_id, run_name=run.path.name).info.run_id
            tags = [RunTag(f"versions.{key}", str(value)[:_LONGEST_PARAM]) for key, value in dotted(versions).items()]
            params = [Param(key, str(value)[:_LONGEST_PARAM]) for key, value in dotted(config).items()]
            for start in range(0, max(len(params), len(tags)), _MOST_PARAMS):
                part = slice(start, start + _MOST_PARAMS)
                self._client.log_batch(self._id, params=params[part], tags=tags[part])
        return {"id": self._id, "tracking_uri": self._client.tracking_uri}

    def _log(self, rows: Sequence[Row]) -> None:
        from mlflow.entities import Metric

        now = int(1e3 * time.time())
        metrics = [Metric(key, value, now, steps) for steps, values in rows for key, value in values.items()]
        for start in range(0, len(metrics), _MOST_METRICS):
            self._client.log_batch(self._id, metrics=metrics[start : start + _MOST_METRICS])

    def _log_finals(self, steps: int, values: Mapping[str, float]) -> None:
        self._log([(steps, values)])

    def _close(self, *, complete: bool) -> None:
        self._client.set_terminated(self._id, status="FINISHED" if complete else "KILLED")
