"""Data about the last control step, for tasks."""

from __future__ import annotations

from collections.abc import Mapping

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action, Floats, Mask, rows_of
from frobs_core.interfaces.simulation import Snapshot
from frobs_core.random import RandomSource


class StepContext:
    """Data about the last control step: the action, and the commands of the joints.

    The environment updates its instance in every step. The arrays are valid until the next step; tasks must not write
    to them. In the first step of an episode, the previous action is zero.

    Args:
        rng: Random source of the environment.
        action_space: Action space of a single environment.
        commands: Joint commands before the first step, by robot: (num_envs, dof) each.

    Attributes:
        rng: Source of all random numbers.
        given_action: (num_envs, …) action that was passed to ``step``; not clipped.
        previous_given_action: The same for the step before.
        commands: Joint commands at the end of the step, by robot: (num_envs, dof) in the units of each joint's command
            mode [rad, rad/s or N·m; m, m/s or N]; after randomized delays.
    """

    def __init__(self, rng: RandomSource, action_space: gym.Space, commands: Mapping[str, Floats]) -> None:  # type: ignore[type-arg]
        self.rng = rng
        shape = (rng.num_envs, *(action_space.shape or ()))
        self._bounds = (action_space.low, action_space.high) if isinstance(action_space, gym.spaces.Box) else None
        self.given_action: Action = np.zeros(shape, np.int64 if self._bounds is None else np.float64)
        self.previous_given_action: Action = np.zeros_like(self.given_action)
        self.commands = dict(commands)

    @property
    def action(self) -> Action:
        """The action, (num_envs, …) in the action space: float64 for a Box, clipped to it; else int64."""
        return self._clipped(self.given_action)

    @property
    def previous_action(self) -> Action:
        """The action of the step before, like :attr:`action`."""
        return self._clipped(self.previous_given_action)

    def _clipped(self, given: Action) -> Action:
        return given if self._bounds is None else np.clip(given, *self._bounds)

    def reset(self, mask: Mask | None) -> None:
        """Clear the actions of the environments of ``mask``."""
        rows = rows_of(mask)
        self.given_action[rows] = 0
        self.previous_given_action[rows] = 0

    def snapshot(self) -> Snapshot:
        """Return a copy of all arrays."""
        arrays = {"action": self.given_action, "previous_action": self.previous_given_action}
        arrays.update({f"commands/{name}": command for name, command in self.commands.items()})
        return {name: array.copy() for name, array in arrays.items()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self.given_action = snapshot["action"].copy()
        self.previous_given_action = snapshot["previous_action"].copy()
        self.commands = {name: snapshot[f"commands/{name}"].copy() for name in self.commands}
