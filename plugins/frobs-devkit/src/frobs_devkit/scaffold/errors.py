"""Errors of ``frobs new``."""

from __future__ import annotations

from frobs_core.util.errors import ConfigurationError


class AnswerError(ConfigurationError):
    """An answer to a question of ``frobs new`` is invalid. The message describes the problem."""


class NameTakenError(ConfigurationError):
    """A name that the new plugin requires is already in use, in the place that ``found`` describes."""

    def __init__(self, kind: str, name: str, found: str) -> None:
        self.kind = kind
        self.name = name
        self.found = found
        super().__init__(
            f"the {kind} '{name}' already exists: {found}; choose another name, or uninstall the existing one."
        )
