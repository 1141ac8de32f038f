"""Training continues to the last step, even if the monitor says that it should end."""

from __future__ import annotations

from frobs_core.contracts import TrainingMonitor
from frobs_core.util.errors import RunError
from templates.algorithm import CrossEntropy


class Faulty(CrossEntropy):
    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        if self._env is None:
            raise RunError("this algorithm was loaded for prediction only; load it with an environment.")
        while self._steps < steps:
            draws = self._rng.normal(self._mean, self._deviation, (self._config.population, self._num_weights))
            metrics = self._learn(draws, self._play(self._env, draws), self._steps / steps)
            if monitor.is_due(self._steps) or self._steps >= steps:
                monitor.on_progress(self._steps, metrics)
                monitor.offer_checkpoint(self._steps, self.save)
