"""Spreading one seed, so that runs with neighbouring seeds share nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_HALF = 2**30


@dataclass(frozen=True)
class RunSeeds:
    """The seeds of a run. Environment *i* of several uses the first one's seed plus *i*."""

    environment: int  # in [0, 2³⁰)
    algorithm: int  # in [0, 2³¹)
    evaluation: int  # in [2³⁰, 2³¹): never one of the training run
    validation: int  # in [2³⁰, 2³¹): the best policy is chosen and measured on different episodes


def spread_seed(seed: int) -> RunSeeds:
    """Spread a seed, ≥ 0, through NumPy's ``SeedSequence``."""
    environment, algorithm, evaluation, validation = (
        int(child.generate_state(1, np.uint32)[0]) for child in np.random.SeedSequence(seed).spawn(4)
    )
    room = _HALF - 2**20
    return RunSeeds(environment % room, algorithm % 2**31, _HALF + evaluation % room, _HALF + validation % room)


def later_seed(seed: int, steps: int) -> int:
    """Return a seed, in [0, 2³⁰), for environments that begin anew after some steps of a training."""
    return int(np.random.SeedSequence([seed, steps]).generate_state(1, np.uint32)[0]) % (_HALF - 2**20)


def draw_seed() -> int:
    """Return a seed that nobody has chosen, in [0, 2³²)."""
    return int(np.random.SeedSequence().generate_state(1, np.uint32)[0])
