"""The contacts of a scene, as questions to Bullet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from frobs_core.interfaces import Contact

Side: TypeAlias = tuple[int, int]
"""Bullet's body and link; −1 for any body, −2 for any link."""

ANY: Side = (-1, -2)


@dataclass(frozen=True)
class Question:
    """What Bullet is asked for one contact.

    Attributes:
        arguments: bodyA, bodyB, linkA, linkB of ``getContactPoints``.
        ignored: What may be the other side and does not count, ``ANY`` link of a body included.
    """

    arguments: tuple[int, int, int, int]
    ignored: frozenset[Side]

    def counts(self, point: Sequence[Any]) -> bool:
        """Return whether a contact point is one; ``getContactPoints`` puts what was asked for first."""
        force, distance = point[9], point[8]
        if not (force > 0.0 or distance <= 0.0):
            return False
        return not self.ignored or ((point[2], point[4]) not in self.ignored and (point[2], -2) not in self.ignored)


def question(contact: Contact, sides: Mapping[str, Side]) -> Question | None:
    """Return what Bullet is asked for a contact; None: one side has no shape.

    Args:
        contact: What the scene declares.
        sides: Bullet's numbers of all that has a shape.
    """
    known = {**sides, "*": ANY}
    if contact.first not in known or contact.second not in known:
        return None
    first, second = known[contact.first], known[contact.second]
    if first == ANY:
        first, second = second, first
    ignored = frozenset(known[side] for side in contact.ignore if side in known)
    return Question((first[0], second[0], first[1], second[1]), ignored)
