"""How simulators translate a robot's model file, and overlaps between a robot's links."""

from __future__ import annotations

from dataclasses import dataclass

from frobs_core.models.notes import Treatment

PHYSICAL = frozenset(
    [
        "collision_shapes",
        "collision_meshes",
        "joint_springs",
        "armatures",
        "gravity_compensation",
        "tendons",
        "equalities",
    ]
)
"""Kinds of elements that affect a robot's motion: the robot moves differently in a simulator that ignores them."""


@dataclass(frozen=True, kw_only=True)
class Translation:
    """A simulator's translation of one kind of model-file element.

    Attributes:
        element: Kind of element, which is a key of ``frobs_models.ELEMENTS``.
        treatment: Whether the element is kept, approximated or dropped.
        how: Single-line description of what replaces the element or what is lost. May be empty if the element is kept.
        names: Links or joints that the translation applies to, or empty for all links or joints that contain the
            element.
    """

    element: str
    treatment: Treatment
    how: str = ""
    names: tuple[str, ...] = ()

    @property
    def changes_motion(self) -> bool:
        """Whether the robot moves differently because the simulator drops the element."""
        return self.treatment is Treatment.DROPPED and self.element in PHYSICAL


@dataclass(frozen=True, kw_only=True)
class Overlap:
    """Two overlapping links of one robot.

    Attributes:
        first: Name of one link.
        second: Name of the other link.
        depth: Penetration depth [m], ≥ 0.
    """

    first: str
    second: str
    depth: float
