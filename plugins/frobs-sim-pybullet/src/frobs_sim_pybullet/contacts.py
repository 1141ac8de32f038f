"""What a scene says of bodies by their names: contacts, as questions to Bullet, and cameras."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from frobs_core.errors import SceneError
from frobs_core.interfaces import Contact, Placement, Scene

Side: TypeAlias = tuple[int, int]
"""Bullet's body and link; −1 for any body, −2 for any link."""

ANY: Side = (-1, -2)


def check_contacts(robots: Mapping[str, Placement], scene: Scene) -> None:
    """Refuse a contact with something that is not there.

    Raises:
        ConfigurationError: It names no body.
    """
    links = {f"{name}/{link.name}" for name, placement in robots.items() for link in placement.model.links}
    for name, contact in scene.contacts.items():
        for side in (contact.first, contact.second, *contact.ignore):
            known = [*scene.bodies, *robots, *(["floor"] if scene.floor else [])]
            if side != "*" and side not in known and side not in links:
                raise SceneError(f"contact '{name}'", f"names '{side}', which is none of {', '.join(known)}.")


def check_cameras(robots: Mapping[str, Placement], scene: Scene) -> None:
    """Refuse a camera that is fixed to nothing.

    Raises:
        ConfigurationError: It names no body.
    """
    links = {f"{name}/{link.name}" for name, placement in robots.items() for link in placement.model.links}
    for name, camera in scene.cameras.items():
        if camera.frame is not None and camera.frame not in links and camera.frame not in scene.bodies:
            raise SceneError(f"camera '{name}'", f"is fixed to '{camera.frame}', which is no body of the scene.")


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
