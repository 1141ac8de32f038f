from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
import pytest

from frobs_core.plain import is_plain, plain


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
