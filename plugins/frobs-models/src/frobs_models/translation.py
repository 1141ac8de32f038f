"""Translation tables of simulators."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TypeAlias

import yaml

from frobs_core.description import Translation
from frobs_core.models import RobotModel, Treatment
from frobs_models.element_kinds import elements

TranslationTable: TypeAlias = Mapping[str, tuple[Treatment, str]]
"""How a simulator handles each kind of element in a model file, by key of ``frobs_models.ELEMENTS``."""


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
    rows = [(kind, table.get(kind, others)) for kind in elements(model)]
    return [Translation(element=kind, treatment=row[0], how=row[1]) for kind, row in rows if row is not None]
