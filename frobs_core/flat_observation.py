"""A flat observation that is composed of named terms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class ObservationTerm:
    """One named part of an observation.

    Attributes:
        low: (k,) smallest values.
        high: (k,) largest values.
        unit: Of its numbers: ``"m"``.
        scale: What a learner may multiply it by, so that the numbers that matter are about 1.
    """

    low: Floats
    high: Floats
    unit: str
    scale: float = 1.0


class FlatObservation:
    """A buffer that holds the terms of all environments side by side.

    Terms are written in place; an observation is a float32 copy of the buffer.

    Args:
        num_envs: ≥ 1.
        terms: By name, in the order of their columns.

    Attributes:
        terms: As given.
        columns: Where each term stands.
        values: (num_envs, k) float64: the buffer.
        space: Of one environment, float32 (k,).
        scale: (k,) the suggested scale of each column.
    """

    def __init__(self, num_envs: int, terms: Mapping[str, ObservationTerm]) -> None:
        self.terms = dict(terms)
        self.columns: dict[str, slice] = {}
        start = 0
        for name, term in self.terms.items():
            self.columns[name] = slice(start, start + len(term.low))
            start += len(term.low)
        self.values: Floats = np.zeros((num_envs, start))
        self.space = gym.spaces.Box(
            np.concatenate([term.low for term in self.terms.values()]).astype(np.float32),
            np.concatenate([term.high for term in self.terms.values()]).astype(np.float32),
            dtype=np.float32,
        )
        self.scale: Floats = np.concatenate([np.full(len(term.low), term.scale) for term in self.terms.values()])

    def view(self, name: str) -> Floats:
        """Return the columns of a term, (num_envs, k) float64: what is written there is observed."""
        return self.values[:, self.columns[name]]

    def describe(self) -> list[dict[str, Any]]:
        """Return a row for each term: name, first and last column, unit and suggested scale."""
        return [
            {
                "name": name,
                "columns": [self.columns[name].start, self.columns[name].stop - 1],
                "unit": term.unit,
                "scale": term.scale,
            }
            for name, term in self.terms.items()
        ]
