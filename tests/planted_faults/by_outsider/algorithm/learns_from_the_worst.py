"""The elite are the draws with the lowest reward."""

from __future__ import annotations

from templates.algorithm import CrossEntropy


class Faulty(CrossEntropy):
    def _learn(self, draws, rewards, progress):
        return super()._learn(draws, -rewards, progress)
