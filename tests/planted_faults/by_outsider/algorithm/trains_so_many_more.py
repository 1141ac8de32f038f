"""``train(steps)`` takes so many more steps: those before a load are not counted."""

from __future__ import annotations

from templates.algorithm import CrossEntropy


class Faulty(CrossEntropy):
    def train(self, steps, monitor):
        super().train(self._steps + steps, monitor)
