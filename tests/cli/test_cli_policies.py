"""``--policy``: one option for everything that acts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from frobs_cli.completion import complete_policy
from frobs_core.plugins.registry import pretrained_path
from frobs_core.util.errors import RenderingUnavailableError

Frobs = Callable[..., Result]
Facts = Callable[..., Any]
REACH, PUSH = "frobs/Irb120Reach-v0", "frobs/PandaPush-v0"


def test_random_actions_are_evaluated(frobs: Frobs) -> None:
    result = frobs("evaluate", PUSH, "--policy", "random", "--episodes", "2", "--set", "seed=3")
    assert result.exit_code == 0, result.stderr
    assert "policy random" in result.stdout
    assert "0.0 %" in result.stdout


def test_a_bundle_is_evaluated_in_its_id_as_by_its_short_form(facts: Facts) -> None:
    path = str(pretrained_path(REACH))
    found = [
        facts("evaluate", REACH, *words, "--episodes", "4")
        for words in (("--policy", "pretrained"), ("--pretrained",), ("--policy", path))
    ]
    assert found[0] == found[1] == found[2]


def test_the_simulator_of_a_trained_policy_can_have_other_settings(facts: Facts, frobs: Frobs) -> None:
    words = ("evaluate", REACH, "--pretrained", "--episodes", "2", "--set")
    found = facts(*words, "environment_kwargs.simulator_kwargs.iterations=50")
    assert found["simulator_kwargs"] == {"iterations": 50}
    assert "iterations=50" in frobs(*words, "environment_kwargs.simulator_kwargs.iterations=50").stdout
    result = frobs(*words, "environment_kwargs.simulator_kwargs.iteration=50")
    assert (result.exit_code, "Did you mean 'iterations'?" in result.stderr) == (2, True)


@pytest.mark.parametrize(
    ("args", "says"),
    [
        ((PUSH, "--policy", "rondom"), "Did you mean 'random'?"),
        ((PUSH, "--policy", "random", "--expert"), "cannot be combined"),
        ((PUSH, "--policy", "random", "--algorithm", "ppo"), "policy 'random' has no parameter 'algorithm'"),
        ((PUSH, "--policy", "random", "--checkpoint", "best"), "policy 'random' has no parameter 'checkpoint'"),
        ((PUSH, "--policy", "runs/none"), "runs/none is not a folder"),
        ((REACH, "--policy", "pretrained", "--set", "seed=1"), "stores its own settings"),
        ((PUSH, "--policy", "BUNDLE"), f"was trained with the ID '{REACH}', but the environment has '{PUSH}'"),
        ((PUSH,), "another --policy from 'frobs list policies'"),
    ],
)
def test_a_wrong_policy_is_one_line(frobs: Frobs, args: tuple[str, ...], says: str) -> None:
    words = [str(pretrained_path(REACH)) if word == "BUNDLE" else word for word in args]
    result = frobs("evaluate", *words)
    assert result.exit_code in (1, 2)
    assert says in " ".join(result.stderr.split())


@pytest.mark.needs("rendering")
def test_an_expert_is_recorded(frobs: Frobs, tmp_path: Path) -> None:
    result = frobs("play", PUSH, "--policy", "expert", "--video", str(tmp_path / "push.mp4"), "--episodes", "1")
    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "push.mp4").stat().st_size > 1000


def test_policies_are_listed_and_completed(facts: Facts) -> None:
    rows = {row["name"]: row["distribution"] for row in facts("list", "policies")["policies"]}
    assert rows == {
        "expert": "frobs-core",
        "pretrained": "frobs-train",
        "random": "frobs-core",
        **dict.fromkeys(("teleop", "teleop:gamepad", "teleop:keyboard"), "frobs-view"),
        "trained": "frobs-train",
    }
    assert complete_policy("") == ["expert", "pretrained", "random", "teleop", "teleop:gamepad", "teleop:keyboard"]


def test_without_a_screen_the_same_command_records_a_video(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    def view(*_: Any, **__: Any) -> None:
        raise RenderingUnavailableError("there is no display", "xvfb")

    monkeypatch.setattr("frobs_train.view", view)
    monkeypatch.setattr("frobs_train.cli.opened.PolicyChoice.open", lambda *_: None)
    result = frobs("play", "CartPole-v1", "--model", "model.zip", "--trust")
    assert "apt-get install xvfb. To record a video instead, repeat the command with --video FILE." in result.stderr
