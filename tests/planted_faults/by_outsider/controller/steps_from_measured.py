"""Steps begin at the measured joint positions, so an arm whose action is zero sinks under its weight."""

from __future__ import annotations

from templates.my_controller import MyController


class Faulty(MyController):
    def apply(self, action):
        self._target = self._joints.joint_positions.copy()
        return super().apply(action)
