"""Translations of a robot's model file by simulators, and overlaps between a robot's links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TypeAlias

import yaml

from frobs_core.models.elements import PHYSICAL, elements
from frobs_core.models.model import RobotModel
from frobs_core.models.notes import Treatment

TranslationTable: TypeAlias = Mapping[str, tuple[Treatment, str]]
"""How a simulator handles each kind of element in a model file, by key of ``frobs_core.models.ELEMENTS``."""


@dataclass(frozen=True, kw_only=True)
class Translation:
    """A simulator's translation of one kind of model-file element.

    Attributes:
        element: Kind of element, which is a key of ``frobs_core.models.ELEMENTS``.
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


@cache
def read_tables(path: Path) -> Mapping[str, TranslationTable]:
    """Read a simulator's translation tables and return them by model format.

    Args:
        path: YAML file with the keys ``both``, ``urdf`` and ``mjcf``, each of which maps elements to ``[treatment,
            how]``.
    """
    given = yaml.safe_load(path.read_text("utf-8"))
    return {
        format: {
            kind: (Treatment(row[0]), "".join(row[1:])) for kind, row in {**given["both"], **given[format]}.items()
        }
        for format in ("urdf", "mjcf")
    }


def translate(
    model: RobotModel, table: TranslationTable, others: tuple[Treatment, str] | None = None
) -> list[Translation]:
    """Return the rows of a translation table for the elements that a model contains.

    Args:
        model: Model of a robot.
        table: Translation of each kind of element.
        others: Translation of element kinds that are missing from the table, or None to omit these kinds.
    """
    found = [(kind, table.get(kind, others)) for kind in elements(model)]
    return [Translation(element=kind, treatment=row[0], how=row[1]) for kind, row in found if row is not None]


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
