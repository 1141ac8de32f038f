"""Budgets for files from strangers: how large, deep and expensive a file may be before it is rejected.

:data:`BUDGETS` lists limits of the core by kind of file, and a :class:`Meter` counts what one file has used. Each
distribution has the budgets of the files that it reads, and ``SECURITY.md`` lists all of them. The limits count bytes,
elements and steps instead of seconds, so that a file that is accepted on a fast machine is accepted on a slow one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import NoReturn

BUDGETS: Mapping[str, Mapping[str, int]] = {
    "YAML file": {
        "bytes": 512 * 2**10,
        "digits in a number": 100,
        "levels of nesting": 50,
        "values": 20_000,  # PyYAML reads about 20,000 values per second
        "values with aliases expanded": 100_000,
    },
    "run folder": {
        "bytes of a JSON file": 16 * 2**20,
        "levels of nesting in a JSON file": 100,
        "bytes of progress.csv": 256 * 2**20,
        "evaluations": 10_000,
    },
}
"""Limits by kind of file and by what is counted, such as ``BUDGETS["YAML file"]["bytes"]``."""


class Meter:
    """Counts what one file uses and rejects the file if it exceeds a limit of its budget.

    Args:
        limits: Limits by what is counted, such as ``BUDGETS["YAML file"]``.
        refuse: Function that raises the caller's error, such as a :class:`~frobs_core.util.errors.ModelFileError`. The
            function receives the reason, which contains the count and the limit.
    """

    def __init__(self, limits: Mapping[str, int], refuse: Callable[[str], NoReturn]) -> None:
        self._limits = limits
        self._refuse = refuse
        self.used: Counter[str] = Counter()

    def spend(self, what: str, amount: int = 1) -> None:
        """Add to a count.

        Args:
            what: Counted quantity, a key of the budget.
            amount: What to add.

        Raises:
            Exception: The error of ``refuse``, if the count exceeds its limit.
        """
        self.used[what] += amount
        self.check(what, self.used[what])

    def check(self, what: str, value: int) -> None:
        """Reject the file if a value, such as the depth of an element, exceeds its limit.

        Args:
            what: Limited quantity, a key of the budget.
            value: The value.

        Raises:
            Exception: The error of ``refuse``.
        """
        if value > self._limits[what]:
            self._refuse(f"it has {value:,} {what}; the limit is {self._limits[what]:,}.")
