"""Spreading one seed, so that runs with neighbouring seeds share nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_HALF = 2**30


@dataclass(frozen=True)
class RunSeeds:
    """The seeds of a run.

    Attributes:
        environment: Of the first training environment, in [0, 2³⁰); environment *i* has this plus *i*.
        algorithm: Of the algorithm, in [0, 2³¹).
        evaluation: Of the first evaluation environment, in [2³⁰, 2³¹): never one of training's.
    """

    environment: int
    algorithm: int
    evaluation: int


def spread_seed(seed: int) -> RunSeeds:
    """Spread a seed, ≥ 0, through NumPy's ``SeedSequence``."""
    environment, algorithm, evaluation = (
        int(child.generate_state(1, np.uint32)[0]) for child in np.random.SeedSequence(seed).spawn(3)
    )
    return RunSeeds(environment % (_HALF - 2**20), algorithm % 2**31, _HALF + evaluation % (_HALF - 2**20))


def draw_seed() -> int:
    """Return a seed that nobody has chosen, in [0, 2³²)."""
    return int(np.random.SeedSequence().generate_state(1, np.uint32)[0])
