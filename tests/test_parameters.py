from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from frobs_core.errors import ConfigurationError
from frobs_core.parameters import boolean, box, finite, non_negative, number_list, numbers, positive


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


def test_a_box_has_its_corners_in_order() -> None:
    low, high = box("low", (0, 0, 0), "high", (1, 2, 3))
    assert (high - low).tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(ConfigurationError, match=r"low \(0, 3, 0\) must be below high \(1, 2, 3\)"):
        box("low", (0, 3, 0), "high", (1, 2, 3))


def test_vectors_are_shown_briefly() -> None:
    assert numbers(np.array([0.5, -0.25, 1.0])) == "(0.5, -0.25, 1)"
