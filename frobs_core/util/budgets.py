"""Budgets for files from strangers: how large, deep and expensive a file may be before it is rejected.

:data:`BUDGETS` lists the limits by kind of file, and a :class:`Meter` counts what one file has used. The limits count
bytes, elements and steps instead of seconds, so that a file that is accepted on a fast machine is accepted on a slow one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import NoReturn

BUDGETS: Mapping[str, Mapping[str, int]] = {
    "robot file": {
        "bytes": 4 * 2**20,
        "elements": 50_000,
        "attributes": 100_000,
        "levels of nesting": 400,
        "attributes of one element": 100,
        "characters of numbers": 2_000,
        "included files": 200,
        "links": 500,
        "MJCF elements": 20_000,
        "<geom> elements": 3_000,
        "<site> elements": 5_000,
        "<joint> elements": 2_000,
        "<camera> elements": 500,
        "<light> elements": 500,
        "actuators": 2_000,
        "inherited attributes": 1_000_000,
        "pixels of textures": 2**24,
        "cells of height fields": 2**24,
        "xacro steps": 300_000,
        "characters of one text": 1_000_000,
        "characters of one expression": 5_000,
        "values of one list": 100_000,
        "levels of nested lists": 50,
    },
    "mesh": {
        "bytes with the files that it names": 256 * 2**20,
        "triangles": 2_000_000,  # building a model from a larger mesh appears to hang
        "triangles to decompose": 20_000,
        "vertices": 12_000_000,
        "parts": 2_000,  # shapes with one material, counted each time the scene uses them
        "levels of nesting": 100,
        "materials": 1_000,  # the reading time is proportional to the square of this number
    },
    "YAML file": {
        "bytes": 512 * 2**10,
        "digits in a number": 100,
        "levels of nesting": 50,
        "values": 20_000,  # PyYAML reads about 20,000 values per second
        "values with aliases expanded": 100_000,
    },
    "policy bundle": {
        "values of the configuration": 2_000,
        "characters of the configuration": 20_000,
        "bits of an integer": 64,
        "control steps of an episode": 100_000,
        "environment steps of a control step": 1_000,
        "stacked or delayed observations": 100,
        "pixels of an observation": 2**20,
    },
    "run folder": {
        "bytes of a JSON file": 16 * 2**20,
        "levels of nesting in a JSON file": 100,
        "bytes of progress.csv": 256 * 2**20,
        "evaluations": 10_000,
    },
}
"""Limits by kind of file and by what is counted, such as ``BUDGETS["mesh"]["bytes"]``. ``frobs_deploy.budgets``, which
does not import the core, contains further limits of policy bundles.
"""


class Meter:
    """Counts what one file uses and rejects the file if it exceeds a limit of its budget.

    Args:
        kind: Kind of file, a key of :data:`BUDGETS`.
        refuse: Function that raises the caller's error, such as a :class:`~frobs_core.util.errors.ModelFileError`. The
            function receives the reason, which contains the count and the limit.
    """

    def __init__(self, kind: str, refuse: Callable[[str], NoReturn]) -> None:
        self._limits = BUDGETS[kind]
        self._refuse = refuse
        self.used: Counter[str] = Counter()

    def spend(self, what: str, amount: int = 1) -> None:
        """Add to a count.

        Args:
            what: What is counted, a key of the budget.
            amount: What to add.

        Raises:
            Exception: The error of ``refuse``, if the count exceeds its limit.
        """
        self.used[what] += amount
        self.check(what, self.used[what])

    def check(self, what: str, value: int) -> None:
        """Reject the file if a value, such as the depth of an element, exceeds its limit.

        Raises:
            Exception: The error of ``refuse``.
        """
        if value > self._limits[what]:
            self._refuse(f"it has {value:,} {what}; the limit is {self._limits[what]:,}.")
