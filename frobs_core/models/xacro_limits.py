"""Limits for one xacro file, so that a small file cannot exhaust memory or expand endlessly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from frobs_core.errors import ModelFileError

MAX_WORK = 400_000
"""Maximum number of work units for expanding one file. One unit takes 1 to 2 µs. The PR2 robot requires 135,000 units.
"""

MAX_CHARACTERS = 1_000_000
"""Maximum length of the value of an expression, property or attribute [characters]."""

MAX_ITEMS = 100_000
"""Maximum number of values in a list or mapping, including nested values."""

MAX_INTEGER = 2**63
"""Limit for the absolute value of integers in expressions."""

MAX_EXPRESSION = 5_000
"""Maximum length of an expression [characters]."""

MAX_NESTING = 50
"""Maximum nesting depth of lists and mappings."""

_CHARACTERS_PER_UNIT = 16
_CONTAINERS = (list, tuple, set, frozenset, dict)


class Budget:
    """Counter for the work of expanding one file.

    Args:
        file: The file, for messages.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        self.left = MAX_WORK

    def spend(self, work: int) -> None:
        """Count work.

        Raises:
            ModelFileError: The limit is exceeded.
        """
        self.left -= work
        if self.left < 0:
            self.refuse(f"expanding the file exceeds the limit of {MAX_WORK:,} steps")

    def refuse(self, reason: str) -> None:
        """Raise a ModelFileError.

        Raises:
            ModelFileError: Always.
        """
        raise ModelFileError(self.file, f"xacro: {reason}; simplify the file's macros and expressions.")

    def check_length(self, count: int) -> None:
        """Check the length of a text before the text is built, and count the length as work.

        Raises:
            ModelFileError: The length exceeds :data:`MAX_CHARACTERS`.
        """
        if count > MAX_CHARACTERS:
            self.refuse(f"a text has {count:,} characters; the limit is {MAX_CHARACTERS:,}")
        self.spend(count // _CHARACTERS_PER_UNIT)

    def check_items(self, count: int) -> None:
        """Check the number of items before a list is built, and count the items as work.

        Raises:
            ModelFileError: The number exceeds :data:`MAX_ITEMS`.
        """
        if count > MAX_ITEMS:
            self.refuse(f"a list has {count:,} values; the limit is {MAX_ITEMS:,}")
        self.spend(count)

    def weigh(self, value: Any) -> int:
        """Return the size of a value, including nested values, and count the size as work.

        Raises:
            ModelFileError: A limit is exceeded.
        """
        if type(value) is int and not -MAX_INTEGER < value < MAX_INTEGER:
            self.refuse("an integer exceeds the limit of 2**63")
        if not isinstance(value, (str, *_CONTAINERS)):
            return 1
        weight, waiting = 0, [(value, 0)]
        while waiting:
            found, depth = waiting.pop()
            weight += 1
            if isinstance(found, str):
                weight += len(found) // _CHARACTERS_PER_UNIT
                if len(found) > MAX_CHARACTERS:
                    self.check_length(len(found))
            elif isinstance(found, _CONTAINERS):
                if depth > MAX_NESTING:
                    self.refuse(f"lists are nested deeper than {MAX_NESTING} levels")
                if weight + len(found) > MAX_ITEMS:
                    self.check_items(weight + len(found))
                waiting += [(item, depth + 1) for item in found]
                if isinstance(found, dict):
                    waiting += [(item, depth + 1) for item in found.values()]
            if weight > MAX_ITEMS:
                self.check_items(weight)
        self.spend(weight)
        return weight
