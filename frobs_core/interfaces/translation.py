"""What a simulator makes of a robot's model file, and what it finds wrong with the robot as it stands."""

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
"""What a simulator makes of each kind of element: treatment and how, by key of ``frobs_core.models.ELEMENTS``."""


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

    @property
    def changes_motion(self) -> bool:
        """Whether the robot moves differently because the simulator drops the element."""
        return self.treatment is Treatment.DROPPED and self.element in PHYSICAL


@cache
def read_tables(path: Path) -> Mapping[str, TranslationTable]:
    """Read a simulator's tables, by format of the model.

    Args:
        path: YAML file whose keys are ``both``, ``urdf`` and ``mjcf``; under them ``element: [treatment, how]``.
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
    """Return the rows of a table for the kinds of elements that a model has.

    Args:
        model: Of a robot.
        table: What becomes of each kind.
        others: What becomes of the kinds that the table lacks; None: they are left out.
    """
    found = [(kind, table.get(kind, others)) for kind in elements(model)]
    return [Translation(element=kind, treatment=row[0], how=row[1]) for kind, row in found if row is not None]


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
