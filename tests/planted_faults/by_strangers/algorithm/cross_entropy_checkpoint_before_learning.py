"""A checkpoint is offered after the episodes of an iteration have been played, but before the distribution has moved."""

from __future__ import annotations

from frobs_core.util.errors import RunError
from templates.algorithm import CrossEntropy


class Faulty(CrossEntropy):
    def train(self, steps, monitor):
        if self._env is None:
            raise RunError("this algorithm was loaded for prediction only; load it with an environment to train it.")
        while self._steps < steps:
            before = self._steps
            draws = self._rng.normal(self._mean, self._deviation, (self._config.population, self._num_weights))
            rewards = self._play(self._env, draws)
            due = monitor.is_due(self._steps) or self._steps >= steps
            if due:
                monitor.offer_checkpoint(self._steps, self.save)
            metrics = self._learn(draws, rewards, before / steps)
            if due and not monitor.on_progress(self._steps, metrics):
                return
