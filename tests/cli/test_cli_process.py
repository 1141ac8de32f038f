"""What only a process of its own can show."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

Process = Callable[..., subprocess.CompletedProcess[str]]
COMMAND = [sys.executable, "-m", "frobs_cli"]
HEAVY = {"torch", "mujoco", "matplotlib", "stable_baselines3", "imageio", "rospy"}


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from frobs_cli import main\n"
        "sys.argv = ['frobs', '--help']\n"
        "try:\n    main()\n"
        "except SystemExit:\n    print('MODULES', *sorted(sys.modules))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    modules = done.stdout.rpartition("MODULES ")[2].split()
    assert "typer" in modules
    assert not HEAVY & set(modules)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (["--controller", "joint_psition"], "Did you mean 'joint_position'"),
        (["--simulator", "mujocco"], "Did you mean 'mujoco'"),
        (["--robot", "irb12"], "Did you mean 'irb120'"),
        (["--set", "environment_kwargs.tolerence=0.1"], "Did you mean 'tolerance'"),
        (["--set", "environment_kwargs.controller_kwargs.max_dleta=1"], "Did you mean 'max_delta'"),
        (["--set", "randomize.mas.scale=2"], "Did you mean 'mass'"),
        (["--set", "environment_kwargs.control_timestep=0.003"], "physics steps"),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else "",
)
def test_a_wrong_name_is_reported_before_anything_heavy_is_imported(given: list[str], says: str) -> None:
    code = (
        "import sys\n"
        "from frobs_cli import main\n"
        f"sys.argv = ['frobs', 'train', 'frobs/Irb120Reach-v0', *{given!r}]\n"
        "try:\n    main()\n"
        "except SystemExit as end:\n    print(end.code, *sorted(sys.modules))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    status, *modules = done.stdout.split()
    assert status == "2"
    assert says in done.stderr
    assert not HEAVY & set(modules)


def test_the_package_itself_imports_no_typer() -> None:
    code = "import sys, frobs_cli; print('typer' in sys.modules or 'rich' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "False\n"


def test_stdout_carries_only_json(process: Process) -> None:
    done = process("list", "--json")
    assert done.returncode == 0
    parts = {"simulators", "robots", "controllers", "tasks", "algorithms", "environments"}
    assert {*parts, "capabilities", "sensor_types", "parameters", "policies", "viewers", "commands"} == set(
        json.loads(done.stdout)
    )


def test_output_to_a_pipe_has_no_colours_and_no_wrapped_lines(process: Process) -> None:
    done = process("list", "controllers")
    assert "\x1b" not in done.stdout
    assert all(line == line.rstrip() for line in done.stdout.splitlines())
    assert len(done.stdout.splitlines()) == 1 + len(
        json.loads(process("list", "controllers", "--json").stdout)["controllers"]
    )


def test_a_terminal_gets_colours_unless_no_color_is_set() -> None:
    assert "\x1b[36m" in _in_terminal(["list", "robots"], columns=80)
    assert "\x1b[3" not in _in_terminal(["list", "robots"], columns=80, NO_COLOR="1")


def test_tables_fit_the_terminal() -> None:
    for columns in (80, 120):
        text = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", _in_terminal(["list"], columns=columns))
        assert max(len(line) for line in text.splitlines()) <= columns


def test_a_reader_that_stops_reading_is_harmless() -> None:
    shell = f"{' '.join(COMMAND)} list | head -n 1"
    done = subprocess.run(["bash", "-c", shell + "; exit ${PIPESTATUS[0]}"], capture_output=True, text=True, timeout=60)
    assert done.stdout == "simulators\n"
    assert done.stderr == ""
    assert done.returncode in (0, 141)  # 0 where all was written before the reader went


def test_a_terminal_that_lacks_characters_gets_question_marks(process: Process) -> None:
    done = process("show", "task:reach", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert done.stderr == ""


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["ctrl-c", "sigterm"])
def test_a_training_that_is_stopped_writes_a_checkpoint_and_says_how_to_go_on(
    number: int, code: int, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    args = ["train", "CartPole-v1", "--steps", "10_000_000", "--run-dir", str(run)]
    args += ["--num-envs", "4", "--set", "algorithm_config.n_steps=32", "--set", "log_every=1"]
    training = subprocess.Popen([*COMMAND, *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert training.stderr is not None
    try:
        assert "training CartPole-v1" in training.stderr.readline()
        training.send_signal(number)
        out, err = training.communicate(timeout=30)
    finally:
        training.kill()
    assert training.returncode == code
    assert out == ""
    [checkpoint] = (run / "checkpoints").iterdir()
    steps = int(checkpoint.name.removeprefix("step_"))
    assert "Training stops after the current rollout and writes a checkpoint" in err
    assert err.splitlines()[-1] == f"interrupted: 'frobs resume {run}' continues from the checkpoint at step {steps:,}"
    assert "Traceback" not in err


def _in_terminal(args: list[str], *, columns: int, **env: str) -> str:
    """Run a command in a pseudo-terminal and return what it writes."""
    import fcntl
    import pty
    import struct
    import termios

    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    inherited = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "COLUMNS", "FORCE_COLOR")}
    child = subprocess.Popen(
        [*COMMAND, *args], stdout=slave, stderr=slave, env={**inherited, "TERM": "xterm-256color", **env}
    )
    os.close(slave)
    written = b""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        try:
            piece = os.read(master, 65536)
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        written += piece
    os.close(master)
    assert child.wait(timeout=10) == 0
    return written.decode().replace("\r\n", "\n")
