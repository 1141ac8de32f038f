from __future__ import annotations

import json
import logging
import struct
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import pytest

from frobs_core.util.errors import MissingDependencyError
from frobs_train import Progress, Run, evaluate, resolve_config, resume, train
from frobs_train.errors import TrainingError
from frobs_train.logs import services
from frobs_train.logs.progress import STEPS, read_progress
from frobs_train.logs.services import Row, ServiceLogger
from frobs_train.runs.fork import fork_run

LINE = "FrobsTests/Line-v0"
SETTINGS = (
    "algorithm_config.n_steps=50",
    "num_envs=4",
    "steps=1000",
    "seed=1",
    "checkpoint_every=400",
    "log_every=200",
)


class FakeLogger(ServiceLogger):
    """Stands for a service whose runs are in memory."""

    name: ClassVar[str] = "wandb"
    runs: ClassVar[dict[str, list[Row]]] = {}
    closed: ClassVar[list[bool]] = []
    finals: ClassVar[list[Mapping[str, float]]] = []
    down: ClassVar[bool] = False

    def _open(self, run: Run, state: Mapping[str, Any]) -> dict[str, Any]:
        id = state.get("id", f"run{len(self.runs)}")
        self.rows = self.runs.setdefault(id, [])
        return {"id": id}

    def _log(self, rows: Sequence[Row]) -> None:
        if FakeLogger.down:
            raise ConnectionError("no network")
        self.rows += rows

    def _log_finals(self, steps: int, values: Mapping[str, float]) -> None:
        self.finals.append(values)

    def _close(self, *, complete: bool) -> None:
        self.closed.append(complete)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> type[FakeLogger]:
    monkeypatch.setattr(services, "check_services", lambda names: None)
    monkeypatch.setattr(services, "make_loggers", lambda names: [FakeLogger() for _ in names])
    monkeypatch.setattr("frobs_train.training.train.make_loggers", services.make_loggers)
    monkeypatch.setattr("frobs_train.training.resume.make_loggers", services.make_loggers)
    monkeypatch.setattr(FakeLogger, "runs", {})
    monkeypatch.setattr(FakeLogger, "closed", [])
    monkeypatch.setattr(FakeLogger, "finals", [])
    monkeypatch.setattr(FakeLogger, "down", False)
    return FakeLogger


def learn(path: Path, *settings: str, on_progress: Any = None) -> Run:
    return train(resolve_config(LINE, settings=[*SETTINGS, *settings]), path, on_progress)


def rows_of(run: Run) -> list[dict[str, float]]:
    """Return the rows of ``progress.csv``, without empty cells."""
    columns = read_progress(run.path / "progress.csv")
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    return [{name: value for name, value in row.items() if value == value} for row in rows]


def assert_equal(sent: Sequence[Mapping[str, float]], run: Run) -> None:
    """Compare rows with ``progress.csv``, which has eight digits."""
    rows = rows_of(run)
    assert [row[STEPS] for row in sent] == [row[STEPS] for row in rows]
    for ours, theirs in zip(rows, sent, strict=True):
        assert {name: theirs[name] for name in ours} == pytest.approx(ours, rel=1e-6)


def test_the_rows_that_are_sent_equal_the_log(fake: type[FakeLogger], tmp_path: Path) -> None:
    run = learn(tmp_path / "run", "log=[wandb]")
    assert_equal([values for _, values in fake.runs["run0"]], run)
    assert fake.closed == [True]
    assert json.loads((run.path / "wandb.json").read_text()) == {"id": "run0", "steps": 1000}


def test_a_resumed_run_sends_no_row_twice(fake: type[FakeLogger], tmp_path: Path) -> None:
    def fail(progress: Progress) -> None:
        if progress.steps == 600:
            raise OSError("killed")

    with pytest.raises(TrainingError):
        learn(tmp_path / "run", "log=[wandb]", on_progress=fail)
    resume(tmp_path / "run")
    assert list(fake.runs) == ["run0"]
    assert [steps for steps, _ in fake.runs["run0"]] == [200, 400, 600, 800, 1000]
    assert fake.closed == [False, True]


def test_rows_before_the_service_was_chosen_are_sent_too(fake: type[FakeLogger], tmp_path: Path) -> None:
    learn(tmp_path / "run", "steps=400")
    run = resume(tmp_path / "run", steps=1000, settings=["log=[wandb]"])
    assert_equal([values for _, values in fake.runs["run0"]], run)


def test_a_fork_is_a_run_of_its_own_with_all_rows(fake: type[FakeLogger], tmp_path: Path) -> None:
    run = learn(tmp_path / "run", "log=[wandb]", "steps=400")
    fork_run(run.path, tmp_path / "fork", run.config)
    fork = resume(tmp_path / "fork", steps=1000)
    assert list(fake.runs) == ["run0", "run1"]
    assert_equal([values for _, values in fake.runs["run1"]], fork)


def test_a_service_that_is_down_delays_its_rows_and_not_the_training(
    fake: type[FakeLogger], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    fake.down = True

    def repair(progress: Progress) -> None:
        fake.down = progress.steps < 600

    with caplog.at_level(logging.WARNING, "frobs"):
        run = learn(tmp_path / "run", "log=[wandb]", on_progress=repair)
    assert_equal([values for _, values in fake.runs["run0"]], run)
    assert [record.message for record in caplog.records if "no network" in record.message] == [
        "wandb cannot be reached: no network. The training run continues. The rows are sent again at the next "
        "checkpoint, and progress.csv contains all rows."
    ]


def test_an_evaluation_is_sent_to_the_same_run(fake: type[FakeLogger], tmp_path: Path) -> None:
    run = learn(tmp_path / "run", "log=[wandb]")
    found = evaluate(run, 4)
    assert list(fake.runs) == ["run0"]
    [values] = fake.finals
    assert values["final/success_rate"] == found.success_rate
    assert values["final/episodes"] == 4


def test_a_missing_package_is_one_error_before_anything_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(services, "find_spec", lambda name: None)
    with pytest.raises(
        MissingDependencyError, match=r"needs mlflow; install with: pip install .*frobs-train\[mlflow\]"
    ):
        learn(tmp_path / "run", "log=[mlflow]")
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_weights_and_biases_gets_every_row_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WANDB_MODE", "offline")
    monkeypatch.setenv("WANDB_ERROR_REPORTING", "false")
    learn(tmp_path / "run", "steps=400", "log=[wandb]")
    run = resume(tmp_path / "run", steps=1000)
    found = evaluate(run, 4)
    id = json.loads((run.path / "wandb.json").read_text())["id"]
    files = sorted((run.path / "wandb").glob(f"offline-run-*-{id}*/*.wandb"))
    assert len(files) == 3
    summary: dict[str, str] = {}
    end = time.monotonic() + 60.0
    while (
        "final/success_rate" not in summary and time.monotonic() < end
    ):  # another process may still write the last file
        records = [record for file in files for record in wandb_records(file)]
        summary = {key(item): item.value_json for it in records for item in it.summary.update}
    rows = [{key(item): json.loads(item.value_json) for item in it.history.item} for it in records if it.history.item]
    assert_equal(rows, run)
    [config, *_] = [it.run.config.update for it in records if it.run.config.update]
    assert {"environment", "versions"} <= {item.key for item in config}
    assert float(summary["final/success_rate"]) == found.success_rate


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning", "ignore::ResourceWarning")
def test_mlflow_gets_every_row_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MLFLOW_DISABLE_TELEMETRY", "true")
    monkeypatch.setenv("MLFLOW_TRACKING_URI", f"sqlite:///{tmp_path}/mlflow.db")
    monkeypatch.chdir(tmp_path)
    learn(tmp_path / "run", "steps=400", "log=[mlflow]")
    run = resume(tmp_path / "run", steps=1000)
    found = evaluate(run, 4)
    from mlflow import MlflowClient

    client = MlflowClient()
    sent = client.get_run(json.loads((run.path / "mlflow.json").read_text())["id"])
    assert sent.info.status == "FINISHED"
    assert sent.data.params["environment"] == LINE
    assert sent.data.params["algorithm_config.n_steps"] == "50"
    assert "versions.python" in sent.data.tags
    assert sent.data.metrics["final/success_rate"] == found.success_rate
    rows: dict[int, dict[str, float]] = {}
    for name in sent.data.metrics:
        if not name.startswith("final/"):
            for metric in client.get_metric_history(sent.info.run_id, name):
                assert name not in rows.setdefault(metric.step, {})  # no value twice
                rows[metric.step][name] = metric.value
    assert_equal([rows[steps] for steps in sorted(rows)], run)


def key(item: Any) -> str:
    """Return the name of a value of Weights & Biases."""
    return item.key or ".".join(item.nested_key)


def wandb_records(file: Path) -> Iterator[Any]:
    """Read the file of an offline run: a header of 7 bytes, and then a LevelDB log of protocol buffers."""
    from wandb.proto.wandb_internal_pb2 import Record  # type: ignore[attr-defined]

    data, position, message = file.read_bytes(), 7, b""
    while position + 7 <= len(data):
        room = 2**15 - position % 2**15
        if room < 7:  # the rest of a block
            position += room
            continue
        _, length, kind = struct.unpack_from("<IHB", data, position)
        message += data[position + 7 : position + 7 + length]
        position += 7 + length
        if kind in (1, 4):  # full, or the last part
            record = Record()
            record.ParseFromString(message)
            yield record
            message = b""
