"""Limits for one xacro file, so that a small file cannot exhaust memory or expand endlessly."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NoReturn

from frobs_core.util.budgets import Meter
from frobs_core.util.errors import ModelFileError
from frobs_models.budgets import BUDGETS

MAX_INTEGER = 2**63
"""Limit for the absolute value of integers in expressions."""

_STEPS = BUDGETS["robot file"]["xacro steps"]
_VALUES = BUDGETS["robot file"]["values of one list"]
_CHARACTERS_PER_UNIT = 16
_PER_COMPLEX = 100  # complex numbers can have the same hash, so that sets of them take quadratic time
_CONTAINERS = (list, tuple, set, frozenset, dict)


class Budget:
    """Counter for the work of expanding one file."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._steps = 0
        self.meter = Meter(BUDGETS["robot file"], lambda reason: self.refuse(reason.removesuffix(".")))

    def spend(self, work: int) -> None:
        """Count work. One step takes 1 to 2 µs. The PR2 robot requires 135,000 steps."""
        self._steps += work
        if self._steps > _STEPS:
            self.meter.check("xacro steps", self._steps)

    def refuse(self, reason: str) -> NoReturn:
        """Raise a ModelFileError."""
        raise ModelFileError(self.file, f"xacro: {reason}; simplify the file's macros and expressions.")

    def check_length(self, count: int) -> None:
        """Check the length of a text before the text is built, and count the length as work."""
        self.meter.check("characters of one text", count)
        self.spend(count // _CHARACTERS_PER_UNIT)

    def check_items(self, count: int) -> None:
        """Check the number of items before a list is built, and count the items as work."""
        self.meter.check("values of one list", count)
        self.spend(count)

    def weigh(self, value: Any) -> int:
        """Return the size of a value, including nested values, and count the size as work."""
        if type(value) is int and not -MAX_INTEGER < value < MAX_INTEGER:
            self.refuse("an integer exceeds the limit of 2**63")
        if not isinstance(value, (str, range, *_CONTAINERS)):
            return 1
        weight, waiting = 0, [(value, 0)]
        while waiting:
            found, depth = waiting.pop()
            weight += 1
            if isinstance(found, str):
                weight += len(found) // _CHARACTERS_PER_UNIT
                self.meter.check("characters of one text", len(found))
            elif isinstance(found, range):
                weight += len(found) // _CHARACTERS_PER_UNIT  # a call can iterate over the range
            elif isinstance(found, complex):
                weight += _PER_COMPLEX
            elif isinstance(found, _CONTAINERS):
                self.meter.check("levels of nested lists", depth)
                self.meter.check("values of one list", weight + len(found))
                waiting += [(item, depth + 1) for item in found]
                if isinstance(found, dict):
                    waiting += [(item, depth + 1) for item in found.values()]
            if weight > _VALUES:
                self.meter.check("values of one list", weight)
        self.spend(weight)
        return weight
