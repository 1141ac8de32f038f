"""Benchmarks a training run: the time of each part, and settings that would make it faster."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

from frobs_core.validation import whole_number
from frobs_devkit.timing import machine
from frobs_devkit.training_advice import advise
from frobs_devkit.training_window import measure_training
from frobs_train import RunConfig


@dataclass(frozen=True)
class TrainingBenchResult:
    """Result of :func:`bench_training`.

    Attributes:
        id: The environment's ID.
        algorithm: Name of the algorithm.
        num_envs: Environments stepped together.
        steps: Environment steps that were measured, after the warm-up and over all environments.
        steps_per_second: Environment steps per second of the measured part of the training run.
        parts: Time of each part per 1,000 environment steps [s]: ``simulation`` (step and reset of the environments),
            the parts that the algorithm names (``inference``, ``updates``, ``storage``) and ``other``. If the algorithm
            names none, ``simulation`` and ``algorithm``. No time is counted twice.
        shares: Share of each part in the total time, in [0, 1].
        checkpoint_seconds: Time to save the algorithm once [s]; not included in the parts.
        checkpoints: Checkpoints in the whole training run.
        total_steps: Environment steps of the whole training run.
        total_seconds: Estimated time of the whole training run, checkpoints included [s].
        suggestions: For each setting that is worth a change, a text with the measured gain. For ``gradient_steps`` of an
            off-policy algorithm also how the time of the updates depends on it.
        machine: Processor, operating system and Python.
    """

    id: str
    algorithm: str
    num_envs: int
    steps: int
    steps_per_second: float
    parts: dict[str, float]
    shares: dict[str, float]
    checkpoint_seconds: float
    checkpoints: int
    total_steps: int
    total_seconds: float
    suggestions: dict[str, str]
    machine: str


def bench_training(config: RunConfig, *, steps: int | None = None, suggest: bool = True) -> TrainingBenchResult:
    """Measure the time of each part of a training run.

    The training run takes place in memory and ends when enough was measured. Everything before the second round of
    updates is warm-up.

    Args:
        config: The configuration, from :func:`frobs_train.resolve_config`.
        steps: Environment steps to measure, rounded up to whole iterations; None: as many as four seconds allow, and at
            least two iterations.
        suggest: Whether to measure alternatives to the settings, which takes a few seconds more.

    Raises:
        UnknownNameError: No such environment ID or algorithm.
        ConfigurationError: A setting or keyword cannot be used, or the algorithm cannot act in the environment.
    """
    if steps is not None:
        whole_number("steps", steps, lowest=1)
    measured = measure_training(config, steps=steps)
    checkpoints = ceil(config.steps / (config.checkpoint_every or max(1, config.steps // 10)))
    return TrainingBenchResult(
        id=config.environment,
        algorithm=config.algorithm,
        num_envs=config.num_envs,
        steps=measured.steps,
        steps_per_second=1.0 / measured.per_step(),
        parts={part: 1_000 * measured.per_step(part) for part in measured.parts},
        shares={part: seconds / measured.seconds for part, seconds in measured.parts.items()},
        checkpoint_seconds=measured.checkpoint_seconds,
        checkpoints=checkpoints,
        total_steps=config.steps,
        total_seconds=config.steps * measured.per_step() + checkpoints * measured.checkpoint_seconds,
        suggestions=advise(config, measured) if suggest else {},
        machine=machine(),
    )
