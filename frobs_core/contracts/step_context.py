"""Data about the last control step, which the environment passes to the task."""

from __future__ import annotations

from collections.abc import Mapping

import gymnasium as gym
import numpy as np

from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.deprecation import renamed_attribute
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.random import RandomSource


class StepContext(Stateful):
    """Data about the last control step: the actions and the joint commands.

    The environment updates this object at every step. The arrays are valid until the next step, and tasks must not
    write to them. At the first step of an episode, the previous action is zero.

    Args:
        rng: Random source of the environment.
        action_space: Action space of a single environment.
        commands: Joint commands before the first step, by robot: (num_envs, dof) each.

    Attributes:
        rng: Source of all random numbers.
        raw_action: Action that was passed to ``step``, without clipping, (num_envs, …).
        previous_raw_action: Action that was passed to the previous ``step``, without clipping, (num_envs, …).
        commands: Joint commands at the end of the step, after randomized delays, by robot: (num_envs, dof) each, in the
            unit of each joint's command mode [rad, rad/s or N·m for revolute joints; m, m/s or N for prismatic joints].
    """

    given_action = renamed_attribute("given_action", "raw_action")
    previous_given_action = renamed_attribute("previous_given_action", "previous_raw_action")

    def __init__(self, rng: RandomSource, action_space: gym.Space, commands: Mapping[str, Floats]) -> None:  # type: ignore[type-arg]
        self.rng = rng
        shape = (rng.num_envs, *(action_space.shape or ()))
        self._bounds = (action_space.low, action_space.high) if isinstance(action_space, gym.spaces.Box) else None
        self.raw_action: Action = np.zeros(shape, np.int64 if self._bounds is None else np.float64)
        self.previous_raw_action: Action = np.zeros_like(self.raw_action)
        self.commands = dict(commands)

    @property
    def action(self) -> Action:
        """The action, (num_envs, …): float64 and clipped to the action space if it is a Box, otherwise int64."""
        return self._clipped(self.raw_action)

    @property
    def previous_action(self) -> Action:
        """The action of the previous step, with the shape and dtype of :attr:`action`."""
        return self._clipped(self.previous_raw_action)

    def _clipped(self, given: Action) -> Action:
        return given if self._bounds is None else np.clip(given, *self._bounds)

    def reset(self, mask: Mask | None) -> None:
        """Set the actions to 0 in the environments selected by ``mask``."""
        rows = rows_of(mask)
        self.raw_action[rows] = 0
        self.previous_raw_action[rows] = 0

    def stored_arrays(self) -> Snapshot:
        commands = {f"commands/{name}": command for name, command in self.commands.items()}
        return {"action": self.raw_action, "previous_action": self.previous_raw_action, **commands}

    def restore(self, snapshot: Snapshot) -> None:
        self.commands = {name: command.copy() for name, command in self.commands.items()}  # a controller may own them
        super().restore(snapshot)
