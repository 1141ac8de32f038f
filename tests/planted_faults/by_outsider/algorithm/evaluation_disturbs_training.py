"""Stochastic predictions draw from the generator of the training: an evaluation in between changes what is learned."""

from __future__ import annotations

import numpy as np

from templates.algorithm import CrossEntropy


class Faulty(CrossEntropy):
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        if deterministic:
            return super().predict(observation, state, episode_start, deterministic)
        seen = np.asarray(observation, np.float64)
        weights = self._rng.normal(self._mean, self._deviation, (len(seen), self._num_weights))
        return self._act(weights, seen), None
