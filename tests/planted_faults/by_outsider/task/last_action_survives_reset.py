"""The penalty on changes of the action remembers the last action itself, and a reset does not forget it."""

from __future__ import annotations

import numpy as np

from templates.my_reach import MyReach


class Faulty(MyReach):
    def bind(self, simulation, control, control_timestep):
        super().bind(simulation, control, control_timestep)
        self._last_action = np.zeros((simulation.num_envs, *control.action_space.shape))

    def reward(self, context):
        super().reward(context)
        change = context.action - self._last_action
        self._last_action = context.action.copy()
        self._reward_terms["smoothness"] = -0.1 * (change**2).sum(axis=-1)
        return np.asarray(sum(self._reward_terms.values()))

    def snapshot(self):
        return {**super().snapshot(), "last_action": self._last_action.copy()}

    def restore(self, snapshot):
        super().restore(snapshot)
        self._last_action = snapshot["last_action"].copy()
