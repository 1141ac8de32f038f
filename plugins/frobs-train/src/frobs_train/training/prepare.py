"""Make the environments and the algorithm of a new training run, before the run folder exists."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium as gym

from frobs_core.contracts import Algorithm
from frobs_train.configuration.config import RunConfig, algorithm_record, resolve_algorithm_config
from frobs_train.logs.recorder import EpisodeRecorder
from frobs_train.logs.statistics import EpisodeStatistics
from frobs_train.training.seeds import spread_seed
from frobs_train.training.session import check_action_space, make_training_env, training_recipe


@dataclass(frozen=True, kw_only=True)
class PreparedTraining:
    """Environments and algorithm of a training run.

    Attributes:
        env: The seeded environments. The caller must close the environments when the run ends.
        recorder: Wrapper that counts the environments' steps and reports finished episodes.
        episodes: Statistics of the episodes that the recorder reports.
        algorithm: The untrained algorithm, which steps the recorder.
    """

    env: gym.vector.VectorEnv[Any, Any, Any]
    recorder: EpisodeRecorder
    episodes: EpisodeStatistics
    algorithm: Algorithm


def prepare_training(config: RunConfig) -> PreparedTraining:
    """Make the environments and the algorithm of a new training run.

    Args:
        config: Configuration from :func:`frobs_train.resolve_config`. The seed defaults to 0.

    Raises:
        UnknownNameError: The environment ID or algorithm does not exist.
        ConfigurationError: A setting or keyword argument is invalid, or the algorithm does not support the action
            space.
    """
    record = algorithm_record(config.algorithm)
    settings = resolve_algorithm_config(record, config.algorithm_config)
    seeds = spread_seed(config.seed or 0)
    env = make_training_env(config)
    try:
        check_action_space(record, config.environment, env.single_action_space)
        episodes = EpisodeStatistics()
        recorder = EpisodeRecorder(env, episodes.add, training_recipe(config))
        recorder.reset(seed=seeds.environment)
        algorithm = record.load()(recorder, settings, seeds.algorithm)
    except BaseException:
        env.close()
        raise
    return PreparedTraining(env=env, recorder=recorder, episodes=episodes, algorithm=algorithm)
