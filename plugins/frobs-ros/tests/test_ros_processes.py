from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from frobs_ros.errors import ProcessError
from frobs_ros.ros import processes

STUBBORN = "trap '' INT TERM; while true; do sleep 0.1; done"
DAEMON = "setsid sh -c 'while true; do sleep 0.1; done' & exec sleep 100"


@pytest.fixture(autouse=True)
def all_ended() -> Iterator[None]:
    yield
    assert processes.owned() == []


def wait_for(what: Callable[[], bool], timeout: float = 20.0) -> None:
    until = time.monotonic() + timeout
    while not what():
        assert time.monotonic() < until, "it did not come about"
        time.sleep(0.02)


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[0]
    except OSError:
        return False
    return state != b"Z"


def start(script: str, **given: object) -> processes.Process:
    process = processes.start("node", ["sh", "-c", script], name="tested", grace=0.4, **given)  # type: ignore[arg-type]
    wait_for(lambda: len(process.pids()) > 0)
    return process


@pytest.mark.parametrize("script", ["exec sleep 100", STUBBORN, DAEMON], ids=["plain", "stubborn", "daemon"])
def test_a_process_ends_with_all_that_came_of_it(script: str) -> None:
    process = start(script)
    if script == DAEMON:
        wait_for(lambda: len(process.pids()) > 2)
    pids = process.pids()
    assert process.stop()
    assert not any(map(is_alive, pids))
    assert process.stop()  # twice is harmless


def test_it_is_interrupted_before_it_is_killed(tmp_path: Path) -> None:
    script = f"trap 'echo int > {tmp_path}/said; exit 0' INT; echo > {tmp_path}/ready; while true; do sleep 0.02; done"
    process = start(script)
    wait_for((tmp_path / "ready").exists)
    process.stop()
    assert (tmp_path / "said").read_text() == "int\n"


def test_what_a_command_leaves_behind_when_it_ends_is_ended(tmp_path: Path) -> None:
    process = start(
        f"setsid sh -c 'echo $$ > {tmp_path}/pid; exec sleep 100' & while [ ! -s {tmp_path}/pid ]; do sleep 0.02; done; sleep 0.1; exit 7"
    )
    wait_for(lambda: not process.is_running)
    assert process.returncode == 7
    assert not is_alive(int((tmp_path / "pid").read_text()))


@pytest.mark.parametrize(
    "end", ["kill -9", "Ctrl-C", *(pytest.param(end, marks=pytest.mark.slow) for end in ("exception", "exit"))]
)
def test_nothing_is_left_when_the_owner_is_gone(end: str, tmp_path: Path) -> None:
    script = f"""
import signal, sys, time
from frobs_ros.ros import processes
signal.signal(signal.SIGINT, signal.default_int_handler)  # which shells take from what runs in the background
process = processes.start("node", ["sh", "-c", {DAEMON!r}], name="tested", grace=0.4)
pids = set()
while len(pids) < 3:
    time.sleep(0.02)
    pids = process.pids()
print(*pids, process.pid, flush=True)
if {end!r} == "exception":
    raise RuntimeError
if {end!r} == "exit":
    sys.exit(0)
time.sleep(100)
"""
    owner = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert owner.stdout is not None
    pids = [int(pid) for pid in owner.stdout.readline().split()]
    assert len(pids) >= 4
    if end == "kill -9":
        owner.kill()
    elif end == "Ctrl-C":
        owner.send_signal(signal.SIGINT)
    owner.wait(30)
    owner.stdout.close()
    wait_for(lambda: not any(map(is_alive, pids)))


def test_an_error_ends_what_was_started_on_the_way() -> None:
    started = []

    def fail() -> None:
        with processes.collected():
            started.append(start("exec sleep 100"))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert [process.is_running for process in started] == [False]


def test_a_process_that_ends_at_once_is_reported_with_what_it_said() -> None:
    process = processes.start("node", ["sh", "-c", "echo no such wheel; exit 4"], name="tested")
    with pytest.raises(
        ProcessError, match=r"(?s)tested: the process ended immediately with exit code 4.*no such wheel"
    ):
        process.wait_until(lambda: False, 20.0)


def test_a_process_that_is_never_ready_is_ended() -> None:
    process = start("exec sleep 100")
    with pytest.raises(ProcessError, match=r"was not ready after 0\.1 s"):
        process.wait_until(lambda: False, 0.1)


def test_a_program_that_is_not_there_is_named() -> None:
    with pytest.raises(ProcessError, match="the program 'gzservant' is not installed"):
        processes.start("gazebo", ["gzservant"], name="tested")


def test_a_process_that_dies_is_started_again_where_that_is_asked_for() -> None:
    process = start("exec sleep 100", respawn=True)
    (first,) = process.pids()
    os.kill(first, signal.SIGKILL)
    wait_for(lambda: bool(process.pids() - {first}))
    process.stop()


def test_without_a_display_there_is_a_log_instead_of_a_window(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    process = start("echo hello; exec sleep 100", terminal=True, output="screen")
    assert "there is no display" in caplog.text
    wait_for(lambda: process.output() == "hello")
    process.stop()


@pytest.mark.needs("xterm")
def test_a_process_in_a_window_ends_as_any_other(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    display = processes.start("node", ["Xvfb", "-displayfd", "1", "-nolisten", "tcp"], name="Xvfb")
    wait_for(lambda: display.output().isdigit())
    monkeypatch.setenv("DISPLAY", f":{display.output()}")
    process = start(
        f"trap 'echo int > {tmp_path}/said; exit 0' INT; echo > {tmp_path}/ready; while true; do sleep 0.02; done",
        terminal=True,
    )
    wait_for((tmp_path / "ready").exists)
    pids = process.pids()
    assert len(pids) >= 2
    process.stop()
    assert not any(map(is_alive, pids))
    assert (tmp_path / "said").exists()
    failing = start("echo last words; exit 1", terminal=True)
    wait_for(lambda: not failing.is_running)
    assert failing.output() == "last words"
    display.stop()
