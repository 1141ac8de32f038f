"""Benchmarks a training run: measures the time of each part, and suggests settings that speed up the training."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

from frobs_core.util.validation import whole_number
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
        num_envs: Number of environments that are stepped as one batch.
        steps: Number of environment steps measured after the warm-up, summed over all environments.
        steps_per_second: Environment steps per second during the measured part of the training run.
        parts: Time of each part per 1,000 environment steps [s]: ``simulation`` (stepping and resetting the
            environments), the parts that the algorithm defines (``inference``, ``updates``, ``storage``), and
            ``other``. If the algorithm defines no parts, the keys are ``simulation`` and ``algorithm``. No time is
            counted twice.
        shares: Fraction of the total time spent in each part, in [0, 1].
        checkpoint_seconds: Time to save the algorithm once [s], not included in ``parts``.
        checkpoints: Number of checkpoints in the whole training run.
        total_steps: Number of environment steps in the whole training run.
        total_seconds: Estimated time of the whole training run, including checkpoints [s].
        suggestions: For each setting that is worth changing, a text that states the measured gain. For an off-policy
            algorithm, the text for ``gradient_steps`` also describes how the update time depends on this setting.
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

    The training run leaves no files behind, and ends once enough steps have been measured. The warm-up ends after two
    rounds of updates, or after 30 seconds.

    Args:
        config: Configuration returned by :func:`frobs_train.resolve_config`.
        steps: Number of environment steps to measure, rounded up to whole iterations. By default, the measurement takes
            at least four seconds and at least two iterations.
        suggest: Whether to measure alternative settings as well, which takes a few more seconds. There are no suggestions
            for several simulators.

    Raises:
        UnknownNameError: The environment ID or the algorithm does not exist.
        ConfigurationError: A setting or keyword is invalid, or does not suit the algorithm.
    """
    if steps is not None:
        whole_number("steps", steps, lowest=1)
    measured = measure_training(config, steps=steps)
    checkpoints = ceil(config.steps / (config.checkpoint_every or max(1, config.steps // 10)))
    return TrainingBenchResult(
        id=config.environment,
        algorithm=config.algorithm,
        num_envs=config.total_envs,
        steps=measured.steps,
        steps_per_second=1.0 / measured.per_step(),
        parts={part: 1_000 * measured.per_step(part) for part in measured.parts},
        shares={part: seconds / measured.seconds for part, seconds in measured.parts.items()},
        checkpoint_seconds=measured.checkpoint_seconds,
        checkpoints=checkpoints,
        total_steps=config.steps,
        total_seconds=config.steps * measured.per_step() + checkpoints * measured.checkpoint_seconds,
        suggestions=advise(config, measured) if suggest and isinstance(config.num_envs, int) else {},
        machine=machine(),
    )
