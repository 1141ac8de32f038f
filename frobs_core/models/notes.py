"""Notes about changes that the model reader makes to a model. Each note refers to a rule."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path


class Treatment(Enum):
    """How an element of a model file is handled."""

    KEPT = "kept"
    APPROXIMATED = "approximated"
    DROPPED = "dropped"


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


@dataclass(frozen=True)
class Note:
    """A difference between a model and its file, or another notable fact about the file.

    Attributes:
        element: The element as written in the file, such as ``<link name="forearm">``.
        rule: Name of the rule, which is a key of ``RULES``.
        text: Description of the problem and how it is handled, without the element's name.
        line: Line number in the file, starting at 1, or None if unknown, for example in a xacro file.
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
        """Whether the author of the file should fix the element."""
        return RULES[self.rule].fault

    def __str__(self) -> str:
        """Return one line, such as ``<link name="forearm">: text``."""
        return f"{self.element}: {self.text}"


RULES: Mapping[str, Rule] = {
    name: Rule(name=name, **{**fields, "treatment": Treatment(fields["treatment"])})
    for name, fields in json.loads(Path(__file__).with_name("rules.json").read_text("utf-8")).items()
}
"""All rules by name, in the order of the table in the documentation."""
