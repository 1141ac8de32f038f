"""What a simulator makes of a robot's model file, and what it finds wrong with the robot as it stands."""

from __future__ import annotations

from dataclasses import dataclass

from frobs_core.models.notes import Treatment


@dataclass(frozen=True, kw_only=True)
class Translation:
    """What becomes of one kind of element of a model file in a simulator.

    Attributes:
        element: A key of ``frobs_core.models.ELEMENTS``.
        treatment: Whether it is kept, approximated or dropped.
        how: What it becomes, or what is lost, in one line; may be empty where it is kept.
        names: The links or joints that this holds for; empty: all that have the element.
    """

    element: str
    treatment: Treatment
    how: str = ""
    names: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Overlap:
    """Two links of one robot that are in each other.

    Attributes:
        first: Name of one link.
        second: Name of the other.
        depth: How far [m]; ≥ 0.
    """

    first: str
    second: str
    depth: float
