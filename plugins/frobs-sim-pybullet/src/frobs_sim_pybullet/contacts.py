"""Finds a scene's declared contacts among Bullet's contact points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from frobs_core.description import Contact
from frobs_core.util.arrays import Floats

Side: TypeAlias = tuple[int, int]
"""Bullet's body index and link index. A body index of −1 means any body, and a link index of −2 means any link."""

ANY: Side = (-1, -2)


@dataclass(frozen=True)
class Question:
    """Definition of a declared contact in terms of Bullet's indices.

    Attributes:
        first: First side of the contact.
        second: Second side of the contact.
        ignored: Objects that are not accepted as the contact's second side. A link index of −2 ignores all links of a
            body.
    """

    first: Side
    second: Side
    ignored: frozenset[Side]

    def direction(self, point: Sequence[Any]) -> int | None:
        """Return which side of this contact includes body A of a Bullet contact point.

        Returns:
            1 for the first side, −1 for the second side, 0 for both sides, or None if the contact point does not belong
            to this contact.
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
    """Return the definition of a declared contact, or None if one of its sides does not have a shape."""
    known = {**sides, "*": ANY}
    if contact.first not in known or contact.second not in known:
        return None
    ignored = frozenset(known[side] for side in contact.ignore if side in known)
    return Question(known[contact.first], known[contact.second], ignored)


def force_on_first(point: Sequence[Any]) -> Floats:
    """Return the force on body A at a Bullet contact point, in the world frame, (3,) [N].

    The contact point must come from an unfiltered query. If a body filter swaps the two bodies, Bullet inverts the
    normal force but not the friction force.
    """
    force: Floats = np.array(point[7]) * point[9] + np.array(point[11]) * point[10] + np.array(point[13]) * point[12]
    return force
