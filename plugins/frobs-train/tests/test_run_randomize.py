"""What is randomised in a training lands in its folder, and an evaluation may take it, leave it or exchange it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from frobs_cli.program import program
from frobs_core.util.errors import ConfigFileError, ConfigurationError, UnknownParameterError
from frobs_train import Run, evaluate, resolve_config, train

REACH = "frobs/Irb120Reach-v0"
RANDOMIZE = {"mass": {"scale": [0.8, 1.2]}, "action_delay": {"steps": [0, 1]}}
TINY = ["algorithm_config.n_steps=8", "algorithm_config.batch_size=32", "steps=64", "num_envs=4"]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    config = resolve_config(REACH, flags={"seed": 1, "randomize": RANDOMIZE}, settings=TINY)
    return train(config, tmp_path_factory.mktemp("randomized") / "run")


def test_the_run_folder_has_what_was_randomised(run: Run) -> None:
    assert Run.open(run.path).config.randomize == RANDOMIZE
    assert run.config.keywords()["randomize"] == RANDOMIZE
    assert "randomize" not in run.config.environment_kwargs
    assert Run.open(run.path).config.keywords(randomize=False) == run.config.environment_kwargs


def test_the_checkpoint_has_what_was_drawn(run: Run) -> None:
    import numpy as np

    with np.load(run.newest_checkpoint()[0].path / "environment.npz") as state:
        assert state["randomization/mass/current"].shape == (4, 7)


def test_an_evaluation_takes_the_nominal_models_unless_it_is_told(run: Run) -> None:
    nominal = evaluate(run, 8)
    randomized = evaluate(run, 8, randomize=True)
    heavier = evaluate(run, 8, randomize={"mass": {"scale": 1.5}})
    assert nominal.randomize is None
    assert randomized.randomize == RANDOMIZE
    assert len({nominal.mean_reward, randomized.mean_reward, heavier.mean_reward}) == 3
    assert nominal == evaluate(run, 8)
    names = sorted(path.stem.partition("8episodes")[2] for path in (run.path / "evaluations").iterdir())
    assert names[:2] == ["", "_randomized"]
    assert names[2].startswith("_randomized-")
    assert {found["randomize"] is None for found in run.evaluations()} == {True, False}


def test_the_command_line_has_a_word_for_it(run: Run) -> None:
    from typer.testing import CliRunner

    result = CliRunner().invoke(program(), ["evaluate", str(run.path), "--randomized", "--episodes", "4", "--json"])
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["randomize"] == RANDOMIZE
    shown = CliRunner().invoke(program(), ["show", str(run.path)])
    assert "mass, action_delay" in shown.stdout


def test_what_was_not_randomised_cannot_be_asked_for() -> None:
    with pytest.raises(ConfigurationError, match="does not randomize anything"):
        resolve_config(REACH).keywords(randomize=True)


def test_settings_reach_into_it() -> None:
    config = resolve_config(REACH, settings=["randomize.mass.scale=[0.9, 1.1]"])
    assert config.randomize == {"mass": {"scale": [0.9, 1.1]}}


def test_mistakes_are_named_with_their_line(tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    file.write_text("randomize:\n  mass: {scale: [0.8, 1.2]}\n  gravty: {scale: 1.1}\n")
    with pytest.raises(ConfigFileError, match=r"settings\.yaml:3: randomize has no parameter 'gravty'. Did you mean"):
        resolve_config(REACH, file=file)
    with pytest.raises(UnknownParameterError, match="Did you mean 'mass'"):
        resolve_config(REACH, flags={"randomize": {"masss": {"scale": 1}}})


def test_it_stands_in_one_place(tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    file.write_text("environment_kwargs:\n  randomize: {mass: {scale: 1.1}}\n")
    with pytest.raises(ConfigFileError, match=r"settings\.yaml:2: 'randomize' is a top-level setting"):
        resolve_config(REACH, file=file)


def test_environments_of_others_are_not_randomised(tmp_path: Path) -> None:
    config = resolve_config("CartPole-v1", flags={"randomize": RANDOMIZE}, settings=TINY)
    with pytest.raises(ConfigurationError, match=r"CartPole-v1.*randomize"):
        train(config, tmp_path / "run")
    assert not (tmp_path / "run").exists()
