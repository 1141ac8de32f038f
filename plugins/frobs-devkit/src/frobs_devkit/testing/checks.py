"""What a check is: a name, what it says, and a function that fails, passes, or owns up to having seen nothing."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias, TypeVar

from frobs_core.errors import FrobsError

Subject = TypeVar("Subject")


class CheckFailure(FrobsError, AssertionError):  # noqa: N818 - pytest's word, and what an author sees
    """A check did not hold; the message says what was expected, what there was, and what the rule is."""


@dataclass(frozen=True)
class Inconclusive:
    """The check ran and saw nothing that could have failed: no episode ended, nothing moved, a package is missing.

    Attributes:
        reason: One line.
    """

    reason: str


@dataclass(frozen=True)
class NotApplicable:
    """The check is about something that the subject does not claim to have.

    Attributes:
        reason: One line.
    """

    reason: str


Outcome: TypeAlias = Inconclusive | NotApplicable | None
"""None: the check held."""


@dataclass(frozen=True)
class Check:
    """One check of the conformance kit.

    Attributes:
        name: Lower case with underscores; unique in its list.
        description: One sentence: the rule.
        run: Does it; raises :class:`CheckFailure`, or whatever the subject raises.
        capability: The simulator's capability that it verifies, or ``""``.
    """

    name: str
    description: str
    run: Callable[[], Outcome]
    capability: str = ""


def collect(subject: Subject, functions: Iterable[Callable[[Subject], Outcome]], prefix: str = "") -> list[Check]:
    """Make checks of functions of one argument: the name is the function's, the description its docstring's first line.

    Args:
        subject: What each function is given when its check runs.
        functions: The checks, in the order in which they are to be run.
        prefix: Put before each name, with a dot.
    """
    return [
        Check(
            name=f"{prefix}.{function.__name__}" if prefix else function.__name__,
            description=(inspect.getdoc(function) or "").partition("\n")[0],
            run=partial(function, subject),
            capability=getattr(function, "capability", ""),
        )
        for function in functions
    ]


def expect(condition: object, message: str) -> None:
    """Raise CheckFailure with ``message`` unless ``condition`` is true."""
    if not condition:
        raise CheckFailure(message)
