from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from frobs_core.util.errors import FrobsError

Frobs = Callable[..., Result]

BAD = {
    "command": (("trian",), "no command is named 'trian'. Did you mean 'train'?"),
    "option": (("train", "CartPole-v1", "--sed", "1"), "--seed"),
    "option of frobs": (("--verison",), "--version"),
    "missing argument": (("evaluate",), "missing argument 'RUN...'"),
    "kind": (("list", "robotz"), "Did you mean 'robots'?"),
    "name": (("show", "ibr120"), "Did you mean 'irb120'?"),
    "name of a kind": (("show", "robot:irb12"), "no robot is named 'irb12'. Did you mean 'irb120'?"),
    "our ID": (("train", "frobs/Irb120Rech-v0"), "Did you mean 'frobs/Irb120Reach-v0'?"),
    "self-importing ID": (("check", "frobs_core:frobs/Irb120Rech-v0"), "Did you mean 'frobs/Irb120Reach-v0'?"),
    "another's ID": (("bench", "CartPol-v1"), "Did you mean 'CartPole-v1'?"),
    "ID without version": (("train", "CartPole"), "Did you mean 'CartPole-v1'?"),
    "module": (("train", "frobs_nowhere:Foo-v0"), "module 'frobs_nowhere' cannot be imported"),
    "module to check": (("check", "frobs_nowhere:Foo-v0"), "module 'frobs_nowhere' cannot be imported"),
    "kind to check": (("check", "robt:irb120"), "Did you mean 'irb120'?"),
    "number": (("train", "CartPole-v1", "--steps", "0"), "--steps"),
    "word for a number": (("train", "CartPole-v1", "--steps", "many"), "--steps"),
    "file": (("train", "CartPole-v1", "--config", "nowhere.yaml"), "nowhere.yaml"),
    "algorithm": (("train", "CartPole-v1", "--algorithm", "ppp"), "Did you mean 'ppo'?"),
    "setting": (("train", "CartPole-v1", "--set", "num_env=2"), "Did you mean 'num_envs'?"),
    "setting without value": (("train", "CartPole-v1", "--set", "num_envs"), "key=value"),
    "run": (("evaluate", "nowhere"), "nowhere is not a folder"),
    "run to plot": (("plot", "nowhere"), "nowhere is not a folder"),
    "run to play": (("play", "nowhere"), "nowhere is not a folder"),
    "run to show": (("show", "run:nowhere"), "nowhere is not a folder"),
    "settings of a part": (("show", "irb120", "--config"), "--config: this option requires a run folder"),
    "memory": (("evaluate", "nowhere", "--memory", "inf"), "--memory: inf is not a number of GB"),
    "video and viewer": (("play", "nowhere", "--video", "x.mp4", "--viewer"), "cannot be combined"),
}


@pytest.mark.parametrize(("args", "says"), BAD.values(), ids=BAD)
def test_bad_input_is_one_line_and_exit_code_2(
    frobs: Frobs, args: tuple[str, ...], says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = frobs(*args)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert says in result.stderr
    assert result.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("args", "env"),
    [(("list", "x", "--debug"), {}), (("--debug", "list", "x"), {}), (("list", "x"), {"FROBS_DEBUG": "1"})],
    ids=["last", "first", "environment variable"],
)
def test_debug_shows_the_traceback(frobs: Frobs, args: tuple[str, ...], env: dict[str, str]) -> None:
    result = frobs(*args, **env)
    assert result.exit_code == 2
    assert "Traceback" in result.stderr
    assert result.stderr.splitlines()[-1].startswith("error: no kind is named 'x'")


def test_debug_can_be_switched_off_in_the_environment(frobs: Frobs) -> None:
    assert "Traceback" not in frobs("list", "x", FROBS_DEBUG="0").stderr


def test_a_missing_package_of_another_environment_is_one_line(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    import gymnasium as gym

    def missing(*_: object) -> None:
        raise gym.error.DependencyNotInstalled("pip install box2d")

    monkeypatch.setattr("frobs_cli.show.describe_environment", missing)
    result = frobs("show", "CartPole-v1")
    assert (result.exit_code, result.stderr) == (2, "error: pip install box2d\n")


def test_a_full_disk_is_one_line(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", "runs/first")

    monkeypatch.setattr("frobs_cli.show.describe_environment", full)
    assert frobs("show", "CartPole-v1").stderr == "error: runs/first: No space left on device\n"


def test_an_error_keeps_its_table(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise FrobsError("simulator 'x' cannot run this\n  needed by  [capability]")

    monkeypatch.setattr("frobs_cli.show.describe_environment", refuse)
    assert frobs("show", "CartPole-v1").stderr.splitlines()[1] == "  needed by  [capability]"


def test_a_bug_is_not_swallowed(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise KeyError("a bug")

    monkeypatch.setattr("frobs_cli.show.describe_environment", broken)
    with pytest.raises(KeyError, match="a bug"):
        frobs("show", "CartPole-v1")


def test_ctrl_c_is_one_line(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("frobs_cli.show.describe_environment", interrupted)
    result = frobs("show", "CartPole-v1")
    assert (result.exit_code, result.stdout, result.stderr) == (130, "", "interrupted\n")
