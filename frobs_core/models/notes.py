"""Notes about the differences between a model and its file."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Treatment(Enum):
    """How an element of a model file is handled."""

    KEPT = "kept"
    APPROXIMATED = "approximated"
    DROPPED = "dropped"


@dataclass(frozen=True)
class Note:
    """A difference between a model and its file, or another notable fact about the file.

    Attributes:
        element: The element as written in the file, such as ``<link name="forearm">``.
        rule: Name of the reader's rule that applies to the element, such as ``"impossible-inertia"``.
        text: Description of the problem and how it is handled, without the element's name.
        line: Line number in the file, starting at 1, or None if unknown, for example in a xacro file.
        treatment: Treatment of the element.
        fault: Whether the author of the file should fix the element. If True, the robot's conformance check fails.
    """

    element: str
    rule: str
    text: str
    line: int | None = None
    treatment: Treatment = Treatment.APPROXIMATED
    fault: bool = False

    def __str__(self) -> str:
        """Return one line, such as ``<link name="forearm">: text``."""
        return f"{self.element}: {self.text}"
