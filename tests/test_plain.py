from __future__ import annotations

import ast
import json
import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
import pytest

from frobs_core.util.plain import is_plain, plain, read_numbers, spell_numbers, to_json


class Color(StrEnum):
    RED = "red"


@dataclass
class Point:
    x: float
    y: object


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (Point(np.float64(1.5), Color.RED), {"x": 1.5, "y": "red"}),
        ({1: (np.int64(2), np.bool_(True), None)}, {"1": [2, True, None]}),
        (np.array([1.0, np.nan]), [1.0, None]),
        ([Path("a/b"), Point], ["a/b", str(Point)]),
    ],
)
def test_a_value_becomes_types_of_json(value: object, expected: object) -> None:
    found = plain(value)
    assert found == expected
    assert is_plain(found)


def test_yaml_keeps_what_json_cannot_hold() -> None:
    kept = object()
    assert plain([np.inf, kept], for_yaml=True) == [np.inf, kept]


@pytest.mark.parametrize("value", [np.float64(1.0), {1: 2}, [Path("a")], Color.RED], ids=repr)
def test_other_types_are_not_plain(value: object) -> None:
    assert not is_plain(value)


def test_json_has_null_for_numbers_that_json_cannot_represent() -> None:
    value = {"rate": math.nan, "bounds": [-math.inf, np.float32(np.inf)], "name": "é"}
    assert to_json(value) == '{"rate": null, "bounds": [null, null], "name": "\\u00e9"}'
    assert json.loads(to_json(value, ascii=False)) == {"rate": None, "bounds": [None, None], "name": "é"}


def test_spelled_numbers_survive_json() -> None:
    value = {"low": [-math.inf, 0.5], "settings": {"clip": math.inf, "name": "inf"}}
    assert read_numbers(json.loads(to_json(spell_numbers(value)))) == value
    assert math.isnan(read_numbers(spell_numbers(math.nan)))


def test_everything_that_is_written_as_json_is_valid_json() -> None:
    """``json.dumps`` would write ``NaN`` and ``Infinity``, which are not JSON."""
    root = Path(__file__).parents[1]
    files = [*root.glob("frobs_core/**/*.py"), *root.glob("plugins/*/src/**/*.py"), *root.glob("templates/**/*.py")]
    lenient = [
        f"{path.relative_to(root)}:{node.lineno}"
        for path in files
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Call)
        and ast.unparse(node.func) in ("json.dump", "json.dumps")
        and "allow_nan" not in [keyword.arg for keyword in node.keywords]
    ]
    assert len(files) > 100
    assert not lenient, "use frobs_core.util.plain.to_json or frobs_core.util.files.write_json, or pass allow_nan=False"
