"""What was done to a model file when it was read: each departure from the file is a note, and each note obeys a rule."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from frobs_core.models.xmltree import Element


class Treatment(Enum):
    """What becomes of an element of a model file."""

    KEPT = "kept"
    APPROXIMATED = "approximated"
    DROPPED = "dropped"


@dataclass(frozen=True, kw_only=True)
class Rule:
    """How one peculiarity of model files is treated.

    Attributes:
        name: Of the rule: ``"impossible-inertia"``.
        about: What the file says, or leaves out.
        treatment: What becomes of it.
        text: What is done.
        fault: Whether the author of the file should mend it; a robot's conformance check fails where one should.
    """

    name: str
    about: str
    treatment: Treatment
    text: str
    fault: bool = False


@dataclass(frozen=True)
class Note:
    """One thing that a model does not hold as its file says it, or that is worth knowing.

    Attributes:
        element: What it is about, as the file has it: ``<link name="forearm">``.
        rule: Name of the rule that was followed, a key of ``RULES``.
        text: What was found and done, without the element.
        line: 1-based line in the file, or None where it is not known (a xacro, or the whole file).
    """

    element: str
    rule: str
    text: str
    line: int | None = None

    @property
    def treatment(self) -> Treatment:
        """What became of the element."""
        return RULES[self.rule].treatment

    @property
    def fault(self) -> bool:
        """Whether the author of the file should mend it."""
        return RULES[self.rule].fault

    def __str__(self) -> str:
        """Return one line: ``<link name="forearm">: text``."""
        return f"{self.element}: {self.text}"


class Notes(list[Note]):
    """Notes while a file is read."""

    def add(self, rule: str, element: Element, text: str) -> None:
        """Note what was done to an element.

        Args:
            rule: Name of the rule.
            element: What it is about.
            text: What was found and done.
        """
        assert rule in RULES
        self.append(Note(element.named(), rule, text, element.line))


RULES: Mapping[str, Rule] = {
    name: Rule(name=name, **{**fields, "treatment": Treatment(fields["treatment"])})
    for name, fields in json.loads(Path(__file__).with_name("rules.json").read_text("utf-8")).items()
}
"""Every rule by name, in the order of the documentation's table."""
