"""Notes about changes to a model file while it was read. Each note follows a rule."""

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
    """Treatment of an element of a model file."""

    KEPT = "kept"
    APPROXIMATED = "approximated"
    DROPPED = "dropped"


@dataclass(frozen=True, kw_only=True)
class Rule:
    """Treatment of one peculiarity of model files.

    Attributes:
        name: Name of the rule: ``"impossible-inertia"``.
        about: Content, or missing content, that the rule applies to.
        treatment: Treatment of the element.
        text: What the reader does.
        fault: Whether the author of the file should fix it. A robot's conformance check then fails.
    """

    name: str
    about: str
    treatment: Treatment
    text: str
    fault: bool = False


@dataclass(frozen=True)
class Note:
    """A difference between a model and its file, or another remarkable fact.

    Attributes:
        element: The element, as in the file: ``<link name="forearm">``.
        rule: Name of the rule, a key of ``RULES``.
        text: The finding and its treatment, without the element.
        line: 1-based line in the file, or None if unknown (a xacro, or the whole file).
    """

    element: str
    rule: str
    text: str
    line: int | None = None

    @property
    def treatment(self) -> Treatment:
        """Treatment of the element."""
        return RULES[self.rule].treatment

    @property
    def fault(self) -> bool:
        """Whether the author of the file should fix it."""
        return RULES[self.rule].fault

    def __str__(self) -> str:
        """Return one line: ``<link name="forearm">: text``."""
        return f"{self.element}: {self.text}"


class Notes(list[Note]):
    """Notes that are collected while a file is read."""

    def add(self, rule: str, element: Element, text: str) -> None:
        """Add a note about an element.

        Args:
            rule: Name of the rule.
            element: The element.
            text: The finding and its treatment.
        """
        assert rule in RULES
        self.append(Note(element.named(), rule, text, element.line))


RULES: Mapping[str, Rule] = {
    name: Rule(name=name, **{**fields, "treatment": Treatment(fields["treatment"])})
    for name, fields in json.loads(Path(__file__).with_name("rules.json").read_text("utf-8")).items()
}
"""All rules by name, in the order of the documentation's table."""
