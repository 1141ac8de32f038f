"""What goes wrong while a run trains: each a clear message, and nothing lost."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import CheckpointError, RunError
from frobs_train import Progress, Run, RunConfig, TrainingInterrupt, evaluate, plot_runs, resume, train
from frobs_train.errors import RunBusyError, TrainingError
from frobs_train.logs.progress import STEPS, read_progress, read_rows
from frobs_train.logs.recorder import EpisodeRecorder
from frobs_train.runs.lock import RunLock
from frobs_train.training.interrupts import Interrupts

FAST = {"n_steps": 8, "batch_size": 16, "n_epochs": 1, "policy_kwargs": {"net_arch": [8]}}
REACH = "frobs/Irb120Reach-v0"


def config(**changes: Any) -> RunConfig:
    values: dict[str, Any] = {"environment": "FrobsTests/Line-v0", "num_envs": 2, "steps": 160, "seed": 0}
    return RunConfig(**{**values, "algorithm_config": FAST, "checkpoint_every": 32, "log_every": 1, **changes})


def rows(run: Run) -> list[dict[str, str]]:
    found = read_rows(run.path / "progress.csv")
    return [{key: value for key, value in row.items() if not key.startswith("time/")} for row in found]


def at(steps: int, act: Callable[[], object]) -> Callable[[Progress], None]:
    """Do something when so many steps were told, once."""
    done: list[object] = []

    def on_progress(progress: Progress) -> None:
        if progress.steps >= steps and not done:
            done.append(act())

    return on_progress


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A real file system of 512 KiB."""
    command = ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", str(tmp_path)]
    subprocess.run(command, check=True)
    yield tmp_path
    subprocess.run(["umount", "--lazy", str(tmp_path)], check=True)


def fill(disk: Path, leave: int) -> Path:
    """Leave so many bytes."""
    ballast = disk / f"ballast{len(list(disk.glob('ballast*')))}"
    free = os.statvfs(disk).f_bavail * os.statvfs(disk).f_frsize
    ballast.write_bytes(bytes(max(0, free - leave)))
    return ballast


# leave: 0: the next row does not fit; 40 kB: rows do, the next checkpoint does not
@pytest.mark.parametrize(("leave", "error"), [(0, RunError), (40_000, CheckpointError)], ids=["row", "checkpoint"])
def test_a_full_disk_ends_the_training_and_it_continues_later(
    leave: int, error: type[Exception], small_disk: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    wanted = config(environment=REACH, keep_checkpoints=1)
    whole = train(wanted, tmp_path_factory.mktemp("whole") / "run")
    path = small_disk / "run"
    with pytest.raises(error, match=r"No space left.*Free some space.*frobs resume"):
        train(wanted, path, at(80, lambda: fill(small_disk, leave)))
    assert Run.open(path).newest_checkpoint()[0].steps == 64
    fill(small_disk, 0)
    with pytest.raises(RunError, match="No space left"):
        resume(path)
    assert Run.open(path).newest_checkpoint()[0].steps == 64
    for ballast in small_disk.glob("ballast*"):
        ballast.unlink()
    assert rows(resume(path)) == rows(whole)


def test_an_evaluation_on_a_full_disk_is_not_lost(small_disk: Path, caplog: pytest.LogCaptureFixture) -> None:
    run = train(config(), small_disk / "run")
    fill(small_disk, 0)
    assert evaluate(run, 3).episodes == 3
    assert "cannot be written: No space left" in caplog.text
    assert not list((run.path / "evaluations").glob("*")) if (run.path / "evaluations").exists() else True


def test_a_read_only_folder_is_told_and_evaluates(small_disk: Path, caplog: pytest.LogCaptureFixture) -> None:
    run = train(config(), small_disk / "run")
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    try:
        with pytest.raises(RunError, match=r"the run folder .* cannot be written: Read-only file system"):
            resume(run, steps=200)
        with pytest.raises(RunError, match=r"cannot be created: Read-only file system"):
            train(config(), small_disk / "other")
        assert evaluate(run, 3).episodes == 3
        assert "Read-only" in caplog.text
    finally:
        subprocess.run(["mount", "-o", "remount,rw", str(small_disk)], check=True)


@pytest.mark.slow
def test_an_environment_that_raises_says_where_and_what_can_be_continued(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = config(environment=REACH, steps=2000, checkpoint_every=320)
    step = EpisodeRecorder.step

    def failing(self: EpisodeRecorder, actions: Any) -> Any:
        if self.steps == 1000:
            raise ValueError("the gripper is stuck")
        return step(self, actions)

    with monkeypatch.context() as patched:
        patched.setattr(EpisodeRecorder, "step", failing)
        with pytest.raises(TrainingError) as caught:
            train(wanted, tmp_path / "run")
    text = str(caught.value)
    assert f"the training run in {tmp_path / 'run'} failed after 1,000 environment steps" in text
    assert "ValueError: the gripper is stuck" in text
    assert "test_survival.py:" in text
    assert f"continue from step 960 with 'frobs resume {tmp_path / 'run'}'" in text
    assert isinstance(caught.value.__cause__, ValueError)
    assert not [path for path in (tmp_path / "run").rglob(".*") if path.name != ".lock"]
    assert resume(tmp_path / "run").checkpoints[-1].steps == 2000


def test_an_environment_that_raises_at_once_leaves_a_run_that_begins_anew(tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="continue from the beginning"):
        train(config(), tmp_path / "run", at(16, lambda: 1 / 0))
    assert resume(tmp_path / "run").checkpoints[-1].steps == 160


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
def test_a_training_that_is_stopped_goes_on_as_if_it_never_was(number: int, tmp_path: Path) -> None:
    wanted = config(environment=REACH, log_every=48, checkpoint_every=96)
    whole = train(wanted, tmp_path / "whole")
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    step = EpisodeRecorder.step

    def stopping(self: EpisodeRecorder, actions: Any) -> Any:
        if self.steps == 70:
            signal.raise_signal(number)
        return step(self, actions)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(EpisodeRecorder, "step", stopping)
        with pytest.raises(TrainingInterrupt) as caught:
            train(wanted, tmp_path / "run")
    assert caught.value.exit_code == 128 + number
    assert str(caught.value) == f"'frobs resume {tmp_path / 'run'}' continues from the checkpoint at step 80"
    run = Run.open(tmp_path / "run")
    assert [item.steps for item in run.checkpoints] == [80]
    assert read_progress(run.path / "progress.csv")[STEPS] == [48]  # an interruption is no reason for a row
    assert rows(resume(run)) == rows(whole)
    assert before == [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]


def test_a_second_ctrl_c_stops_at_once(tmp_path: Path) -> None:
    step = EpisodeRecorder.step

    def stopping(self: EpisodeRecorder, actions: Any) -> Any:
        if self.steps in (40, 42):
            signal.raise_signal(signal.SIGINT)
        return step(self, actions)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(EpisodeRecorder, "step", stopping)
        with pytest.raises(TrainingInterrupt, match="at step 32"):
            train(config(), tmp_path / "run")
    assert [item.steps for item in Run.open(tmp_path / "run").checkpoints] == [32]


def test_ctrl_c_while_a_checkpoint_is_written_waits_for_it(tmp_path: Path) -> None:
    with pytest.raises(TrainingInterrupt, match="at step 32"):
        train(config(), tmp_path / "run", at(32, lambda: signal.raise_signal(signal.SIGINT)))
    assert [item.steps for item in Run.open(tmp_path / "run").checkpoints] == [32]


def test_in_another_thread_signals_are_left_alone() -> None:
    import threading

    found: list[Any] = []

    def enter() -> None:
        with Interrupts():
            found.append(signal.getsignal(signal.SIGINT))

    before = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert found == [before]


@pytest.mark.slow
def test_one_process_trains_in_a_folder_and_the_others_are_told_which(tmp_path: Path) -> None:
    run = train(config(), tmp_path / "run")
    code = (
        "import sys; from pathlib import Path; from frobs_train.runs.lock import RunLock\n"
        "with RunLock(Path(sys.argv[1])): print('held', flush=True); sys.stdin.read()"
    )
    holder = subprocess.Popen(
        [sys.executable, "-c", code, str(run.path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None
    try:
        assert holder.stdout.readline() == "held\n"
        acts: tuple[Callable[[], object], ...] = (
            lambda: resume(run, steps=200),
            lambda: train(config(), run.path, on_existing="overwrite"),
            lambda: train(config(steps=200), run.path, on_existing="resume"),
        )
        for act in acts:
            with pytest.raises(RunBusyError, match=f"process {holder.pid} on .* is training in") as caught:
                act()
            assert caught.value.pid == holder.pid
        assert evaluate(run, 3).episodes == 3
        assert plot_runs([run]).is_file()
    finally:
        holder.kill()
        holder.communicate()
    assert resume(run, steps=176).checkpoints[-1].steps == 176  # death has released it


def test_without_locks_the_process_that_the_file_names_decides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frobs_train.runs.lock._lock", lambda descriptor: None)
    other = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    import socket

    (tmp_path / ".lock").write_text(json.dumps({"pid": other.pid, "host": socket.gethostname()}))
    with pytest.raises(RunBusyError, match=f"process {other.pid}"), RunLock(tmp_path):
        pass
    other.communicate()
    with RunLock(tmp_path):
        assert json.loads((tmp_path / ".lock").read_text())["pid"] == os.getpid()
    (tmp_path / ".lock").write_text('{"pid": 1, "host": "elsewhere"}')
    with pytest.raises(RunBusyError, match="process 1 on elsewhere"), RunLock(tmp_path):
        pass


def test_a_damaged_lock_file_is_harmless(tmp_path: Path) -> None:
    (tmp_path / ".lock").write_bytes(b"\xff{")
    with RunLock(tmp_path), pytest.raises(RunBusyError), RunLock(tmp_path):
        pass
