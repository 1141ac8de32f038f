"""``--pretrained``: the policies that come with IDs, on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

Frobs = Callable[..., Result]
Facts = Callable[..., Any]
REACH = "frobs/Irb120Reach-v0"
WITHOUT = "frobs/Reach-v0"


def test_the_policy_of_an_id_is_evaluated(frobs: Frobs) -> None:
    result = frobs("evaluate", REACH, "--pretrained", "--episodes", "8", "--json")
    found = json.loads(result.stdout)
    assert found["environment"] == REACH
    assert found["episodes"] == 8
    assert found["run"].endswith("irb120reach.frobs")
    shown = frobs("evaluate", REACH, "--pretrained", "--episodes", "8").stdout
    assert "trained policy" in shown
    assert REACH in shown


BAD = {
    "ID without one": (("evaluate", WITHOUT, "--pretrained"), f"{WITHOUT} has no trained policy"),
    "which have one": (("evaluate", WITHOUT, "--pretrained"), REACH),
    "mistyped ID": (("play", "frobs/Irb120Raech-v0", "--pretrained"), f"Did you mean '{REACH}'?"),
    "model too": (("play", REACH, "--pretrained", "--model", "model.zip"), "cannot be combined"),
    "flag forgotten": (("evaluate", REACH), f"{REACH}: this is an environment ID, not a run; add --pretrained"),
}


@pytest.mark.parametrize(("args", "says"), BAD.values(), ids=BAD)
def test_what_cannot_be_opened_is_one_line(frobs: Frobs, args: tuple[str, ...], says: str) -> None:
    result = frobs(*args)
    assert result.exit_code == 2
    assert says in " ".join(result.stderr.split())


@pytest.mark.needs("imageio_ffmpeg")
@pytest.mark.slow
def test_a_policy_is_recorded(frobs: Frobs, tmp_path: Path) -> None:
    video = tmp_path / "reach.mp4"
    result = frobs("play", REACH, "--pretrained", "--video", str(video), "--episodes", "1")
    assert result.exit_code == 0
    assert video.stat().st_size > 1000


def test_lists_and_pages_tell_of_the_policy(frobs: Frobs, facts: Facts) -> None:
    rows = {row["id"]: row["pretrained"] for row in facts("list", "envs")["environments"]}
    assert rows[WITHOUT] is None
    assert rows[REACH]["success_rate"] > 0.9
    assert f"{100 * rows[REACH]['success_rate']:.1f} %" in frobs("list", "envs").stdout
    [found] = facts("show", REACH)
    assert found["pretrained"] == rows[REACH]
    shown = " ".join(frobs("show", REACH).stdout.split())
    assert f"frobs play {REACH} --pretrained" in shown
    assert rows[REACH]["sha256"] in shown
    [without] = facts("show", WITHOUT)
    assert without["pretrained"] is None
