"""What is returned is the target before the action was added: every command is one control step late."""

from __future__ import annotations

from templates.my_controller import MyController


class Faulty(MyController):
    def apply(self, action):
        before = self._target.copy()
        super().apply(action)
        return before
