"""Behavior cloning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium as gym
import torch as th

from frobs_algos import demonstrations
from frobs_algos_imitation.algorithm import ImitationAlgorithm
from frobs_algos_imitation.config import CloningConfig, ImitationConfig
from frobs_algos_imitation.samples import Samples, in_order
from frobs_core.contracts import TrainingMonitor


class BC(ImitationAlgorithm):
    """Behavior cloning: supervised learning of the demonstrated actions (Pomerleau 1989).

    The steps of a training run are updates of the network. The environments of the run are not stepped.
    """

    name: ClassVar[str] = "bc"
    config_model: ClassVar[type[ImitationConfig]] = CloningConfig

    _config: CloningConfig

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None:
        super().__init__(env, config, seed)
        self._load_samples(env)  # now, so that a wrong source leaves no run folder behind

    @property
    def _chunk(self) -> int:
        return 1

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Train until the total number of updates reaches ``steps``."""
        self._training_env()
        total, count = 0.0, 0
        while self.steps < steps:
            total, count = total + self._update(self.steps / steps), count + 1
            self.steps += 1
            if not monitor.is_due(self.steps) and self.steps < steps:
                continue
            go_on = monitor.on_progress(self.steps, {f"{self.name}/loss": total / count})
            total, count = 0.0, 0
            monitor.offer_checkpoint(self.steps, self.save)
            if not go_on:
                return

    def _load_samples(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        config = self._config
        source, episodes, mapping = config.demonstrations, config.demonstration_episodes, config.demonstration_mapping
        shown = demonstrations.load(source, env, episodes, self._seed, mapping)
        th.set_num_threads(config.torch_threads)  # opening a trained policy may change it
        observation: Any = in_order(shown.observation, self.observation_space)
        action = shown.action if config.history > 1 else None
        self.samples = Samples.of(observation, action, shown.action, shown.episode_start)
        self.policy.normalize(self.samples.frames)
