"""Notes that are collected while a file is read, each of which refers to a rule."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from frobs_core.models import Note, Treatment
from frobs_models.xmltree import Element


@dataclass(frozen=True, kw_only=True)
class Rule:
    """Rule for handling a peculiarity of model files.

    Attributes:
        name: Name of the rule, such as ``"impossible-inertia"``.
        about: Content of the file, present or missing, to which the rule applies.
        treatment: Treatment of the element.
        text: Description of the treatment.
        fault: Whether the author of the file should fix the peculiarity. If True, the robot's conformance check fails.
    """

    name: str
    about: str
    treatment: Treatment
    text: str
    fault: bool = False


RULES: Mapping[str, Rule] = {
    name: Rule(name=name, **{**fields, "treatment": Treatment(fields["treatment"])})
    for name, fields in json.loads(Path(__file__).with_name("rules.json").read_text("utf-8")).items()
}
"""All rules by name, in the order of the table in the documentation."""


class Notes(list[Note]):
    """Notes that are collected while a file is read."""

    def add(self, rule: str, element: Element, text: str) -> None:
        """Add a note about an element."""
        self.append(Note(element.named(), rule, text, element.line, RULES[rule].treatment, RULES[rule].fault))
