"""The contacts of a scene among Bullet's contact points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.interfaces import Contact

Side: TypeAlias = tuple[int, int]
"""Bullet's body and link; −1 for any body, −2 for any link."""

ANY: Side = (-1, -2)


@dataclass(frozen=True)
class Question:
    """What counts as one contact.

    Attributes:
        first: Its first side.
        second: Its second side.
        ignored: What may be the second side and does not count, ``ANY`` link of a body included.
    """

    first: Side
    second: Side
    ignored: frozenset[Side]

    def direction(self, point: Sequence[Any]) -> int | None:
        """Return on what the force acts that a contact point of Bullet exerts on its body A.

        Returns:
            1: the first side; −1: the second side; 0: both; None: the point is none of this contact.
        """
        a, b = (point[1], point[3]), (point[2], point[4])
        forward, backward = self._joins(a, b), self._joins(b, a)
        return forward - backward if forward or backward else None

    def _joins(self, one: Side, other: Side) -> bool:
        return (
            _covers(self.first, one)
            and _covers(self.second, other)
            and not (self.ignored and (other in self.ignored or (other[0], ANY[1]) in self.ignored))
        )


def _covers(side: Side, shape: Side) -> bool:
    return side in (ANY, shape, (shape[0], ANY[1]))


def question(contact: Contact, sides: Mapping[str, Side]) -> Question | None:
    """Return what counts as a contact; None: one side has no shape.

    Args:
        contact: What the scene declares.
        sides: Bullet's numbers of all that has a shape.
    """
    known = {**sides, "*": ANY}
    if contact.first not in known or contact.second not in known:
        return None
    ignored = frozenset(known[side] for side in contact.ignore if side in known)
    return Question(known[contact.first], known[contact.second], ignored)


def force_on_first(point: Sequence[Any]) -> Floats:
    """Return the force that a contact point of Bullet exerts on its body A, (3,) [N] in the world.

    Bullet turns the normal, not the friction, if a filter for bodies exchanges the two. Ask without filters.
    """
    force: Floats = np.array(point[7]) * point[9] + np.array(point[11]) * point[10] + np.array(point[13]) * point[12]
    return force
