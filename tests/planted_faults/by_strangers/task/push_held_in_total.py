"""The success condition must have been met for some steps in total, not for the last steps in a row."""

from __future__ import annotations

from frobs_tasks_manipulation.push import Push


class Faulty(Push):
    def advance(self, context):
        self._update()
        self._held += self.achieved
