"""Errors of the replacement for moveit_commander."""

from __future__ import annotations

from collections.abc import Iterable

from frobs_core.util.errors import FrobsError, nearest


class MoveItCommanderException(FrobsError):  # noqa: N818 - the name is MoveIt's
    """A call to moveit_commander failed."""


def check_known(owner: str, kind: str, name: str, known: Iterable[str]) -> None:
    """Raise a MoveItCommanderException that lists the known names if ``name`` is not one of them."""
    if name not in (names := list(known)):
        raise MoveItCommanderException(
            f"the {owner} has no {kind} '{name}'; the available {kind}s are: {', '.join(names) or 'none'}."
        )


class NotOfferedError(MoveItCommanderException, AttributeError):
    """A MoveIt function is not available in the replacement.

    Args:
        owner: The class or module.
        name: The function.
        available: The names that the class or module provides.
    """

    def __init__(self, owner: str, name: str, available: Iterable[str]) -> None:
        self.owner, self.missing = owner, name
        self.available = tuple(sorted(one for one in available if not one.startswith("_")))
        suggestion = nearest(name, self.available)
        hint = f" The nearest name is '{suggestion}'." if suggestion else ""
        super().__init__(
            f"FRobs's replacement for moveit_commander does not implement {owner}.{name}.{hint} "
            "Install MoveIt to use the complete moveit_commander."
        )
