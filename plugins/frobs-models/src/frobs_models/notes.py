"""Notes that are collected while a file is read."""

from __future__ import annotations

from frobs_core.models import RULES, Note
from frobs_models.xmltree import Element


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
