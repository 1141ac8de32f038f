"""A training run that is shown while it learns."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from typer.testing import CliRunner
from view_clients import PROTOCOL, wait_until
from websockets.sync.client import connect

from frobs_cli.program import program
from frobs_core import load_policy
from frobs_core.util.errors import MissingDependencyError
from frobs_train import Run, RunConfig, train
from frobs_train.cli.training_view import check_view
from frobs_view import BrowserViewer, Player, ViewServer
from frobs_view.following import Following

REACH = "frobs/Irb120Reach-v0"
FAST = {"n_steps": 16, "batch_size": 32, "n_epochs": 1}


def config(steps: int) -> RunConfig:
    return RunConfig(
        environment=REACH,
        algorithm="ppo",
        algorithm_config=FAST,
        steps=steps,
        seed=1,
        num_envs=4,
        checkpoint_every=64,
        log_every=1,
    )


@pytest.fixture
def followed(tmp_path: Path) -> Any:
    """The parts of a view of a run that has not begun."""
    env: Any = gym.make(REACH)
    with closing(ViewServer()) as server:
        viewer = BrowserViewer(server)
        viewer.bind(env.unwrapped)
        makers = {"random": lambda: load_policy("random", env), "run": lambda: pytest.fail("opened by the follower")}
        player = Player(env, viewer, makers)
        player.reset(0)
        yield tmp_path / "run", player, Following(tmp_path / "run", env, viewer, player, "run")
        player.close()
        env.close()


def test_the_newest_policy_acts_and_the_curve_grows(followed: Any) -> None:
    folder, player, following = followed
    following.poll()
    assert (player.name, following._newest.value) == ("random", "")
    train(config(128), folder)
    following._due = 0.0
    following.poll()
    assert (player.name, player._chooser.value, following._newest.value) == ("run", "run", "128")
    player.step()
    first = player._opened["run"]
    following._due = 0.0
    following.poll()
    assert player._opened["run"] is first  # nothing is newer
    with (folder / "progress.csv").open("a") as file:
        file.write("1,2")  # a row that is being written
    following._due = 0.0
    following.poll()
    assert following._rows == (folder / "progress.csv").read_text().count("\n") - 1


def test_a_damaged_checkpoint_keeps_the_policy(followed: Any) -> None:
    folder, player, following = followed
    train(config(64), folder)
    following.poll()
    policy = player._opened["run"]
    for path in (folder / "checkpoints").rglob("policy.pt"):
        path.write_bytes(b"x")
    following._steps, following._due = 0, 0.0
    following.poll()
    assert player._opened["run"] is policy


@pytest.mark.parametrize("words", [[], ["--follow"]])
def test_a_run_folder_can_be_viewed(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    train(config(64), tmp_path / "run")
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(program(), ["view", "run", "--seconds", "3", *words])
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("http://localhost:")


@pytest.mark.parametrize(
    ("words", "text"),
    [(["--seeds", "2"], "a view shows one run"), (["--on-existing", "increment"], "choose another --run-dir")],
)
def test_what_a_view_of_a_training_run_cannot_show_is_an_error(words: list[str], text: str, tmp_path: Path) -> None:
    result = CliRunner().invoke(program(), ["train", REACH, "--view", "--run-dir", str(tmp_path / "run"), *words])
    assert result.exit_code == 2
    assert text in " ".join(result.stderr.split())
    assert list(tmp_path.iterdir()) == []


def test_without_frobs_view_the_flag_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frobs_train.cli.training_view.installed_commands", lambda: ({}, []))
    with pytest.raises(MissingDependencyError, match=r"--view needs frobs-view; install with: pip install"):
        check_view()


def test_a_view_ends_with_the_program_that_started_it(tmp_path: Path) -> None:
    view = subprocess.Popen(
        [sys.executable, "-m", "frobs_cli", "view", str(tmp_path / "absent"), "--follow"], stdin=subprocess.PIPE
    )
    with pytest.raises(subprocess.TimeoutExpired):
        view.wait(3.0)
    assert view.stdin is not None
    view.stdin.close()
    assert view.wait(60.0) == 0


@pytest.mark.slow
def test_a_view_does_not_change_the_result(tmp_path: Path) -> None:
    """Train alone, and train with a page that is opened, closed and opened again."""
    settings = [f"--set=algorithm_config.{name}={value}" for name, value in FAST.items()]
    command = [sys.executable, "-m", "frobs_cli", "train", REACH, "--steps=6000", "--seed=3", "--num-envs=4"]
    command += [*settings, "--set=checkpoint_every=1000"]
    subprocess.run([*command, f"--run-dir={tmp_path / 'alone'}"], check=True, capture_output=True, timeout=300)
    with (tmp_path / "log").open("w") as log:
        shown = subprocess.Popen(
            [*command, f"--run-dir={tmp_path / 'shown'}", "--view"], stdout=subprocess.DEVNULL, stderr=log
        )
    wait_until(lambda: "http://" in (tmp_path / "log").read_text(), 120.0)
    found = re.search(r"http://(localhost:\d+)/", (tmp_path / "log").read_text())
    assert found is not None
    received = 0
    for _ in range(3):
        with (
            suppress(OSError),
            connect(
                f"ws://{found[1]}",
                origin=f"http://{found[1]}",  # type: ignore[arg-type]
                subprotocols=[PROTOCOL],  # type: ignore[list-item]
                max_size=None,
                proxy=None,
            ) as client,
        ):
            received += len(client.recv(timeout=5.0))
            time.sleep(0.5)
    assert shown.wait(300.0) == 0, (tmp_path / "log").read_text()
    assert received > 1000
    alone, with_view = (files(tmp_path / name) for name in ("alone", "shown"))
    assert alone.keys() == with_view.keys()
    assert [name for name in alone if alone[name] != with_view[name]] == []
    assert len(Run.open(tmp_path / "shown").checkpoints) > 1


def files(run: Path) -> dict[str, bytes]:
    """Return the files of the checkpoints that contain no times."""
    return {
        str(path.relative_to(run)): path.read_bytes()
        for path in sorted((run / "checkpoints").rglob("*"))
        if path.suffix in (".pt", ".npz")
    }
