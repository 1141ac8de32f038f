"""Load the policy of a run."""

from __future__ import annotations

import logging
from typing import Any, cast

import gymnasium as gym

from frobs_core.contracts import Algorithm
from frobs_core.util.errors import CheckpointError, RunError
from frobs_train.configuration.config import algorithm_record, differences
from frobs_train.export.bundle_run import BundleRun
from frobs_train.runs.expert_run import ExpertPolicy, ExpertRun
from frobs_train.runs.model_file import ModelFile
from frobs_train.runs.run import Run

_log = logging.getLogger("frobs")


def acting_policy(run: Run, env: Any, checkpoint: str | int = "newest") -> tuple[Algorithm, int]:
    """Return the policy of a run, a bundle or a model file, or the expert of the environment's task.

    Args:
        run: The run.
        env: A single or vector environment.
        checkpoint: Checkpoint to load: ``"newest"`` for the newest undamaged checkpoint, ``"best"``, or a number of
            environment steps.

    Returns:
        The policy, which supports at least ``predict``, and the number of environment steps for which it was trained.

    Raises:
        RunError: The environment's spaces differ from the spaces used in training, or its task has no expert.
    """
    if isinstance(run, ExpertRun):
        return cast("Algorithm", ExpertPolicy(env)), 0
    observation_space = getattr(env, "single_observation_space", env.observation_space)
    return load_policy(run, observation_space, getattr(env, "single_action_space", env.action_space), checkpoint)


def load_policy(
    run: Run, observation_space: gym.Space[Any], action_space: gym.Space[Any], checkpoint: str | int = "newest"
) -> tuple[Algorithm, int]:
    """Load a checkpoint for prediction.

    ``run`` may still be training. ``run`` may also be a bundle or a model file.

    Args:
        run: The run.
        observation_space: Observation space of a single environment in which the policy will act.
        action_space: Action space of a single environment in which the policy will act.
        checkpoint: Checkpoint to load: ``"newest"`` for the newest undamaged checkpoint, ``"best"``, or a number of
            environment steps.

    Returns:
        The algorithm, and the number of environment steps for which it was trained. For a bundle or a model file,
        only the spaces and the ``predict`` method of the algorithm are available.
    """
    if isinstance(run, BundleRun | ModelFile):
        if checkpoint != "newest":
            what = "policy bundle" if isinstance(run, BundleRun) else "model file"
            raise RunError(f"{run.path} is a {what}, which contains only one policy; omit --checkpoint.")
        return cast("tuple[Algorithm, int]", run.load_policy(observation_space, action_space))
    if run.edited is not None:
        keys = ", ".join(key for key, _, _ in differences(run.config.model_dump(), run.edited.model_dump()))
        _log.warning(
            "%s was edited: %s. The edits are ignored, and the values from training are used.",
            run.path / "config.yaml",
            keys,
        )
    algorithm, steps = _load(run, checkpoint)
    for what, trained, now in (
        ("observation", algorithm.observation_space, observation_space),
        ("action", algorithm.action_space, action_space),
    ):
        if trained != now:
            raise RunError(
                f"{run.path}: the policy was trained with {what} space {trained}, but the space of the environment is "
                f"{now}; use the same keyword arguments as in training."
            )
    return algorithm, steps


def _load(run: Run, which: str | int, attempts: int = 3) -> tuple[Algorithm, int]:
    """Load a checkpoint, and try again if a running training process has removed the checkpoint."""
    checkpoint, damaged = run.find_checkpoint(which)
    for line in damaged:
        _log.warning("%s The previous checkpoint is used.", line)
    try:
        algorithm: Algorithm = algorithm_record(run.config.algorithm).load().load(checkpoint.path / "algorithm")
    except CheckpointError:
        if checkpoint.path.exists() or attempts == 1:
            raise
        return _load(run, which, attempts - 1)
    return algorithm, checkpoint.steps
