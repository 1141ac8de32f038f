"""The policy that a run has learned."""

from __future__ import annotations

import logging
from typing import Any

import gymnasium as gym

from frobs_core.errors import RunError
from frobs_core.interfaces.algorithm import Algorithm
from frobs_core.runs.config import algorithm_record
from frobs_core.runs.run import Run

_log = logging.getLogger("frobs")


def load_policy(run: Run, observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> tuple[Algorithm, int]:
    """Load the newest undamaged checkpoint for prediction.

    Args:
        run: The run.
        observation_space: Of one environment that the policy is to act in.
        action_space: Of the same.

    Returns:
        The algorithm, and the environment steps that it had trained for.

    Raises:
        CheckpointError: No checkpoint is usable.
        RunError: The environment's spaces are not those of the training.
    """
    checkpoint, damaged = run.newest_checkpoint()
    for line in damaged:
        _log.warning("%s The one before is used.", line)
    algorithm: Algorithm = algorithm_record(run.config.algorithm).load().load(checkpoint.path / "algorithm")
    for what, trained, now in (
        ("observation", algorithm.observation_space, observation_space),
        ("action", algorithm.action_space, action_space),
    ):
        if trained != now:
            raise RunError(
                f"{run.path}: the policy was trained with {what} space {trained}, and the environment has {now}; "
                "use the environment's keywords of the training."
            )
    return algorithm, checkpoint.steps
