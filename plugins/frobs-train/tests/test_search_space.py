from __future__ import annotations

from pathlib import Path
from typing import Any

import optuna
import pytest

from frobs_core import plugins
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import ConfigFileError, ConfigurationError
from frobs_core.util.yaml import ConfigMapping, load_yaml_text
from frobs_train import resolve_config
from frobs_train.configuration.config import algorithm_record
from frobs_train.configuration.resolve import write_setting
from frobs_train.tuning.search_space import load_space, read_space

SEARCHED = [name for name in plugins.records("algorithm") if algorithm_record(name).search_space]


def draw(text: str, **fixed: Any) -> dict[str, Any]:
    space = read_space(load_yaml_text(text))
    trial: Any = optuna.trial.FixedTrial(fixed)
    return {key: dimension.draw(trial, key) for key, dimension in space.items()}


def test_numbers_choices_and_lists_are_drawn() -> None:
    text = """
    a: {type: float, low: 1e-5, high: 1, log: true}
    b: {type: int, low: 2, high: 8, step: 2}
    c: {type: choice, choices: [x, 2, null]}
    d: [[64, 64], [128]]
    e: {type: float, low: 0.1, high: 0.2, prefix: lin_}
    """
    drawn = draw(text, a=0.01, b=4, c=None, d="[64, 64]", e=0.125)
    assert drawn == {"a": 0.01, "b": 4, "c": None, "d": [64, 64], "e": "lin_0.125"}


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("a: {type: float, low: 1}", "'low' and 'high'"),
        ("a: {type: float, low: 2, high: 1}", "is greater than"),
        ("a: {type: float, low: 0, high: 1, log: true}", "must be positive"),
        ("a: {type: int, low: 0.5, high: 1}", "must be whole"),
        ("a: {type: choice, low: 1}", "a dimension of type choice requires 'choices'"),
        ("a: {type: float, lwo: 1, high: 2}", "Did you mean 'low'"),
        ("a: 3", "is not a search range"),
        ("a: []", "is not a search range"),
    ],
)
def test_a_wrong_dimension_is_named_with_its_line(line: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "space.yaml"
    file.write_text(f"# a space\n{line}\n")
    with pytest.raises(ConfigFileError, match=message) as caught:
        load_space(algorithm_record("ppo"), file)
    assert f"{file}:2" in str(caught.value)


def test_a_space_may_be_given_without_a_file() -> None:
    with pytest.raises(ConfigurationError, match="is not a search range"):
        read_space(ConfigMapping({"a": 3}))


def test_an_algorithm_without_a_space_says_how_to_give_one() -> None:
    record = AlgorithmRecord(name="none", summary="", entry_point="m:n")
    with pytest.raises(ConfigurationError, match="--space FILE"):
        load_space(record)


@pytest.mark.parametrize("name", SEARCHED)
def test_every_offered_space_fits_its_algorithm(name: str) -> None:
    for key, dimension in load_space(algorithm_record(name)).items():
        values = dimension.choices or [dimension.example]
        for value in values:
            resolve_config("CartPole-v1", flags={"algorithm": name}, settings=[write_setting(key, value)])
