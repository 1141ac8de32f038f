"""Derive the seeds of a run from one seed, so that runs with consecutive seeds share no random numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_HALF = 2**30


@dataclass(frozen=True)
class RunSeeds:
    """Seeds of a run. In a vector environment, environment *i* uses the seed plus *i*."""

    environment: int  # in [0, 2³⁰)
    algorithm: int  # in [0, 2³¹)
    evaluation: int  # in [2³⁰, 2³¹), never used in training
    validation: int  # in [2³⁰, 2³¹), for evaluations that select the best policy during training


def spread_seed(seed: int) -> RunSeeds:
    """Derive the seeds of a run from one seed, ≥ 0, with NumPy's ``SeedSequence``."""
    environment, algorithm, evaluation, validation = (
        int(child.generate_state(1, np.uint32)[0]) for child in np.random.SeedSequence(seed).spawn(4)
    )
    room = _HALF - 2**20
    return RunSeeds(environment % room, algorithm % 2**31, _HALF + evaluation % room, _HALF + validation % room)


def later_seed(seed: int, steps: int) -> int:
    """Return a seed, in [0, 2³⁰), for resetting the environments after a number of training steps."""
    return int(np.random.SeedSequence([seed, steps]).generate_state(1, np.uint32)[0]) % (_HALF - 2**20)


def draw_seed() -> int:
    """Return a random seed, in [0, 2³²)."""
    return int(np.random.SeedSequence().generate_state(1, np.uint32)[0])
