"""Trainings whose Gazebo servers die: they go on, or end in order with what it takes to go on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest
import yaml

from frobs_train import Run

STEPS, EVERY = 1000, 100
CONFIG = {
    "steps": STEPS,
    "num_envs": 2,
    "seed": 0,
    "checkpoint_every": EVERY,
    "log_every": 1,
    "algorithm_config": {"n_steps": 50, "batch_size": 50, "n_epochs": 1, "policy_kwargs": {"net_arch": [8]}},
}
pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("gazebo")]


def children(pid: int) -> set[int]:
    """Return the gzservers that a process has started and that live."""
    found = set()
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                name, _, rest = (folder / "stat").read_text().partition("(")[2].rpartition(")")
            except OSError:
                continue  # it ended meanwhile
            state, parent = rest.split()[:2]
            if int(parent) == pid and name.startswith("gzserver") and state != "Z":
                found.add(int(folder.name))
    return found


class Training:
    """``frobs train`` or ``frobs resume`` on Gazebo, in a process group of its own as a shell's.

    Attributes:
        process: It.
        path: The run's folder.
        servers: The gzservers that have been seen.
    """

    def __init__(self, path: Path, log: Path, *command: str) -> None:
        self.path, self._log, self.servers = path, log, set[int]()
        with log.open("w") as file:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "frobs_cli", *command],
                stdout=file,
                stderr=file,
                start_new_session=True,
                preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),  # shells take it from the background
            )

    def until(self, condition: Callable[[], object], longest: float = 120.0) -> None:
        """Watch until something is so; what the training has said is in the complaint."""
        end = time.monotonic() + longest
        while not condition():
            assert time.monotonic() < end, self.log
            time.sleep(0.03)

    def until_checkpoint(self, steps: int) -> None:
        """Watch until a checkpoint is there that it can be continued from."""
        checkpoint = self.path / "checkpoints" / f"step_{steps:09d}"
        self.until(lambda: checkpoint.is_dir() or self.process.poll() is not None)
        assert self.process.poll() is None, self.log
        self.servers |= children(self.process.pid)

    def kill(self, servers: set[int]) -> None:
        """Do what the kernel does where memory is short."""
        self.servers |= servers
        for pid in servers:
            with suppress(ProcessLookupError):  # it ended by itself since it was listed
                os.kill(pid, signal.SIGKILL)

    @property
    def log(self) -> str:
        """What it has said."""
        return self._log.read_text()

    def end(self) -> int:
        """Wait for it and return its exit code; no server of it is left."""
        self.until(lambda: self.process.poll() is not None)
        assert not [pid for pid in self.servers if Path(f"/proc/{pid}").exists()]
        assert "Traceback" not in self.log, self.log
        return self.process.returncode

    def stop(self) -> None:
        """End it if it runs, whatever it does; its servers end with it."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


Start = Callable[..., Training]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts trainings of one run, and ends what a failed test leaves."""
    config, running = tmp_path / "config.yaml", list[Training]()
    config.write_text(yaml.safe_dump(CONFIG))
    path = tmp_path / "run"
    begin = ("train", "frobs/Irb120Reach-v0", "--simulator", "gazebo", "--config", str(config), "--run-dir", str(path))

    def started(*command: str) -> Training:
        running.append(Training(path, tmp_path / f"{len(running)}.log", *(command or begin)))
        return running[-1]

    yield started
    for training in running:
        training.stop()


def check_resume(start: Start, path: Path) -> None:
    resumed = start("resume", str(path))
    assert resumed.end() == 0, resumed.log
    assert Run.open(path).checkpoints[-1].steps == STEPS


def test_a_training_goes_on_when_one_of_its_servers_is_killed(start: Start) -> None:
    training = start()
    training.until_checkpoint(EVERY)
    training.kill({min(training.servers)})
    training.until(lambda: len(children(training.process.pid) | training.servers) == 3)  # another takes its place
    training.servers |= children(training.process.pid)
    assert training.end() == 0, training.log
    assert training.log.count("lost its Gazebo server: gzserver was killed by SIGKILL") == 1
    run = Run.open(training.path)
    assert run.checkpoints[-1].steps == STEPS
    start("resume", str(training.path)).end()
    assert Run.open(training.path).checkpoints == run.checkpoints  # it is complete


def test_a_training_whose_servers_are_killed_again_and_again_ends_and_can_be_resumed(start: Start) -> None:
    training = start()
    training.until_checkpoint(EVERY)
    while training.process.poll() is None:
        training.kill(children(training.process.pid))
        time.sleep(0.02)
    assert training.end() == 2
    (last,) = [line for line in training.log.splitlines() if f"frobs resume {training.path}" in line]
    assert "lost 3 consecutive Gazebo servers" in last
    assert Run.open(training.path).checkpoints
    check_resume(start, training.path)


@pytest.mark.parametrize("killed", [False, True], ids=["all is well", "a server was just killed"])
def test_ctrl_c_ends_a_training_in_order(killed: bool, start: Start) -> None:
    training = start()
    training.until_checkpoint(EVERY)
    if killed:
        training.kill({min(training.servers)})
    os.killpg(training.process.pid, signal.SIGINT)  # as a terminal does: servers have no part in it
    assert training.end() == 130, training.log
    assert f"frobs resume {training.path}" in training.log
    check_resume(start, training.path)


def test_ctrl_c_while_servers_start_leaves_none(start: Start) -> None:
    training = start()
    training.until(lambda: children(training.process.pid))
    training.servers |= children(training.process.pid)
    os.killpg(training.process.pid, signal.SIGINT)
    assert training.end() == 130, training.log
    assert not training.path.exists()
