from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from frobs_core import plugins

Frobs = Callable[..., Result]
ID = "frobs/Irb120Reach-v0"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--num-envs", "1,x"), "--num-envs: '1,x' is not a list of positive whole numbers, such as 1,8,64."),
        (("--scaling", "--processes", "0,1"), "--processes: '0,1' is not a list of positive whole numbers"),
        (("--num-envs", "1,8"), "--num-envs: a list of numbers requires --scaling"),
        (("--processes", "1"), "--processes: this option requires --scaling."),
        (("--runner", "ray"), "--runner: this option requires --scaling"),
        (("--scaling", "--training"), "--training: choose one of --training, --cameras and --scaling."),
        (("--scaling", "--steps", "1000"), "--steps: --scaling measures for a given time; use --seconds."),
        (("--scaling", "--algorithm", "sac"), "--algorithm: this option requires --training."),
        (("--scaling", "--jobs", "1,2"), "--jobs: this option requires a cluster; add --runner ray."),
        (("--scaling", "--out", "plot.pdf"), "--out: 'plot.pdf' is not a PNG file"),
        (("--scaling", "--args", "a:=1"), "--args: use --set environment_kwargs.… with --scaling."),
        (("--scaling", "--ray-address", "10.0.0.1:6379"), "add --runner ray"),
    ],
)
def test_bad_options_are_one_clear_error(frobs: Frobs, options: tuple[str, ...], message: str) -> None:
    result = frobs("bench", ID, *options)
    assert result.exit_code != 0
    assert message in " ".join(result.stderr.split())


def test_an_environment_that_cannot_be_made_is_one_clear_error(frobs: Frobs) -> None:
    result = frobs("bench", "CartPole-v1", "--scaling", "--simulator", "mujoco", "--num-envs", "1")
    assert result.exit_code != 0
    assert "'CartPole-v1' cannot be built with simulator='mujoco'" in result.stderr


def test_scaling_needs_no_algorithm(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    measured: list[Any] = []
    monkeypatch.setattr("frobs_devkit.cli.bench.report_scaling", lambda config, *_, **__: measured.append(config))
    found = [each for each in distributions() if each.name.startswith("frobs-") and "-algos-" not in each.name]
    with plugins.isolated(plugins.Plugins(found, strict=False, disabled=())):
        result = frobs("bench", ID, "--scaling")
        assert result.exit_code == 0, result.stderr
        assert "no algorithm is named 'ppo'" in frobs("bench", ID, "--training").stderr
    assert measured[0].environment == ID


@pytest.mark.slow
def test_bench_measures_scaling(facts: Callable[..., Any], tmp_path: Path) -> None:
    picture = tmp_path / "scaling.png"
    ranges = ("--num-envs", "1,4", "--threads", "2", "--processes", "1,2", "--seconds", "0.2")
    found = facts("bench", ID, "--scaling", *ranges, "--out", str(picture))
    sizes = [(point["sweep"], point["num_envs"], point["threads"], point["processes"]) for point in found["points"]]
    chosen = found["num_envs"]
    assert sizes == [
        ("num_envs", 1, 1, 1),
        ("num_envs", 4, 1, 1),
        ("threads", chosen, 2, 1),
        ("processes", chosen, 1, 1),
        ("processes", chosen, 1, 2),
    ]
    for point in found["points"]:
        assert 0.0 < point["low"] <= point["steps_per_second"] <= point["high"]
        assert 3e7 < point["memory"] < 1e9
    assert picture.is_file()
    assert found["picture"] == str(picture)
