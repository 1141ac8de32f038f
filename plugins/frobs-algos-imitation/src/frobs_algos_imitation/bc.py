"""Behavior cloning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium as gym

from frobs_algos_imitation.algorithm import ImitationAlgorithm
from frobs_algos_imitation.config import CloningConfig, ImitationConfig
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
        source, episodes = self._config.demonstrations, self._config.demonstration_episodes
        # Now, so that a wrong source leaves no run folder behind.
        self.samples = self._samples_of(source, episodes, self._config.demonstration_mapping)
        self.policy.normalize(self.samples.frames)

    @property
    def _chunk(self) -> int:
        return 1

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Train until the total number of updates reaches ``steps``."""
        self._train_by_updates(steps, monitor)
