"""DAgger."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from frobs_algos.demonstrations import clipped
from frobs_algos_imitation.algorithm import ImitationAlgorithm
from frobs_algos_imitation.config import DaggerConfig, ImitationConfig
from frobs_algos_imitation.samples import Samples, flatten, in_order
from frobs_core import load_policy
from frobs_core.contracts import Policy, TrainingMonitor


class Dagger(ImitationAlgorithm):
    """Dataset aggregation (Ross et al. 2011).

    In the first round, the expert acts in one episode of each environment. In all later rounds, the learner acts, and
    the expert labels the states that the learner visits.
    """

    name: ClassVar[str] = "dagger"
    config_model: ClassVar[type[ImitationConfig]] = DaggerConfig

    _config: DaggerConfig

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None:
        super().__init__(env, config, seed)
        load_policy(self._config.expert, env).close()  # so that a wrong name leaves no run folder behind

    @property
    def _chunk(self) -> int:
        return 1

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Train until the total number of environment steps reaches ``steps``. The last round is completed."""
        with closing(load_policy(self._config.expert, self._training_env())) as expert:
            while self.steps < steps:
                first = self.samples is None
                collected, taken = self._play(expert, first)
                self.samples = collected if self.samples is None else self.samples + collected
                self.steps += taken
                if first:
                    self.policy.normalize(self.samples.frames)
                updates = self._config.updates if self.steps < steps else self._config.final_updates
                loss = self._fit(updates)
                if not monitor.is_due(self.steps) and self.steps < steps:
                    continue
                go_on = monitor.on_progress(self.steps, {"dagger/loss": loss, "dagger/samples": len(self.samples)})
                monitor.offer_checkpoint(self.steps, self.save)
                if not go_on:
                    return

    def _fit(self, updates: int) -> float:
        """Fit the network to all samples, and return the mean loss of the last tenth of the updates."""
        self._begin_fit()
        losses = [self._update(index / updates) for index in range(updates)]
        return float(np.mean(losses[-max(1, updates // 10) :]))

    def _play(self, expert: Policy, expert_acts: bool) -> tuple[Samples, int]:
        """Play at least one episode in every environment; return the labeled samples and the number of steps."""
        env, space = self._training_env(), self.action_space
        seen, _ = env.reset()
        start, ended = np.ones(env.num_envs, np.bool_), np.zeros(env.num_envs, np.bool_)
        state: tuple[np.ndarray[Any, Any], ...] | None = None
        steps: list[tuple[Any, ...]] = []
        while not ended.all():
            label = clipped(expert.act(seen, start), space)
            action = label
            if not expert_acts:
                action, state = self.predict(seen, state, start)
            steps.append((flatten(in_order(seen, self.observation_space)), action.copy(), label.copy(), start))
            seen, _, terminated, truncated, _ = env.step(action)
            start = terminated | truncated
            ended |= start
        # One environment after another, so that the frames of an episode follow each other.
        observation, action, label, start = (
            np.stack([step[part] for step in steps], axis=1).reshape(-1, *np.shape(steps[0][part])[1:])
            for part in range(4)
        )
        executed = action if self._config.history > 1 else None
        return Samples.of(observation, executed, label, start), len(steps) * env.num_envs
