from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel, ConfigDict, Field

from frobs_core.util.errors import (
    ConfigFileError,
    ConfigurationError,
    MissingSettingError,
    ParameterValueError,
    UnknownParameterError,
)
from frobs_core.util.validation import boolean, finite, non_negative, number_list, numbers, positive, validate
from frobs_core.util.yaml import load_yaml_text, merge


class Every(BaseModel):
    model_config = ConfigDict(extra="forbid")
    episodes: int = 1


class Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    width: int = Field(1, ge=1)
    rate: float | str = 0.1
    every: int | Every | None = None


class Outer(BaseModel):
    model_config = ConfigDict(extra="forbid")
    steps: int
    inner: Inner = Inner()


def test_an_unknown_key_names_the_nearest() -> None:
    with pytest.raises(UnknownParameterError, match=r"thing has no parameter 'step'\. Did you mean 'steps'\?"):
        validate(Outer, {"step": 3}, "thing")


def test_an_unknown_inner_key_names_where_it_stands() -> None:
    with pytest.raises(UnknownParameterError, match=r"'inner' of thing has no parameter 'with'\. Did you mean 'width'"):
        validate(Outer, {"steps": 1, "inner": {"with": 3}}, "thing")


def test_a_bad_value_names_the_key_and_the_bound() -> None:
    with pytest.raises(ParameterValueError, match=r"thing: inner\.width is 0; it must be greater than or equal to 1"):
        validate(Outer, {"steps": 1, "inner": {"width": 0}}, "thing")


def test_a_missing_key_is_named() -> None:
    with pytest.raises(MissingSettingError, match="thing needs steps"):
        validate(Outer, {}, "thing")


def test_a_member_of_a_union_is_not_named() -> None:
    with pytest.raises(ConfigurationError, match=r"thing: inner\.rate is \[\]"):
        validate(Outer, {"steps": 1, "inner": {"rate": []}}, "thing")


def test_the_nearest_key_is_found_inside_a_union() -> None:
    with pytest.raises(UnknownParameterError, match="Did you mean 'episodes'"):
        validate(Outer, {"steps": 1, "inner": {"every": {"episode": 3}}}, "thing")


def test_a_key_from_a_file_is_reported_with_file_and_line() -> None:
    settings = load_yaml_text("steps: 1\ninner:\n  wdth: 3\n", "x.yaml")
    with pytest.raises(ConfigFileError, match=r"x\.yaml:3: 'inner' of thing has no parameter 'wdth'"):
        validate(Outer, settings, "thing")


def test_a_key_that_overrides_a_file_is_not_blamed_on_it() -> None:
    settings = merge(load_yaml_text("steps: 1\n", "x.yaml"), {"steps": "many"})
    with pytest.raises(ConfigurationError, match=r"^thing: steps is 'many'"):
        validate(Outer, settings, "thing")


@pytest.mark.parametrize(
    ("check", "good", "bad"),
    [
        (finite, -2, (np.nan, np.inf, "2", True, None)),
        (positive, 0.1, (0.0, -1.0)),
        (non_negative, 0.0, (-0.1,)),
        (boolean, np.True_, (1, "true", None)),
        (number_list, [1, 2.5], ((), 3.0, "12", [1, "2"])),
    ],
)
def test_what_cannot_be_used_is_refused_by_name(
    check: Callable[[str, Any], Any], good: Any, bad: tuple[Any, ...]
) -> None:
    check("tolerance", good)
    for value in bad:
        with pytest.raises(ConfigurationError, match="tolerance"):
            check("tolerance", value)


def test_vectors_are_shown_briefly() -> None:
    assert numbers(np.array([0.5, -0.25, 1.0])) == "(0.5, -0.25, 1)"
