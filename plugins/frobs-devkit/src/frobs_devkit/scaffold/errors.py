"""Errors of ``frobs new``."""

from __future__ import annotations

from frobs_core.errors import ConfigurationError


class AnswerError(ConfigurationError):
    """An answer to a question of ``frobs new`` is invalid; the message names the question."""


class NameTakenError(ConfigurationError):
    """The name of the new plugin is already used.

    Args:
        kind: ``"distribution"``, ``"Python package"``, ``"ID"`` or one of the five kinds.
        name: The name.
        found: Where it exists.
    """

    def __init__(self, kind: str, name: str, found: str) -> None:
        self.kind = kind
        self.name = name
        self.found = found
        super().__init__(f"the {kind} '{name}' already exists: {found}; choose another name, or uninstall it.")
