"""Conversion of steps from many environments to RLlib's episodes."""

from __future__ import annotations

import uuid
from typing import Any

import gymnasium as gym
import numpy as np
from ray.rllib.core.columns import Columns
from ray.rllib.env.single_agent_episode import SingleAgentEpisode
from ray.rllib.env.utils.infinite_lookback_buffer import InfiniteLookbackBuffer

Array = np.ndarray[Any, Any]
_NOTHING: dict[str, Any] = {}
"""The ``info`` of every step. All steps share this dictionary, which is neither read nor modified."""


class Fragments:
    """Collects the steps of all environments in arrays, and splits the arrays into fragments of episodes.

    Args:
        steps: Number of steps in each environment.
        observation: Observations before the first step (num_envs, k), float32.
        action_space: Action space of the networks.
    """

    def __init__(self, steps: int, observation: Array, action_space: gym.Space[Any]) -> None:
        num_envs, size = observation.shape
        self._observations = np.empty((steps + 1, num_envs, size), np.float32)
        self._observations[0] = observation
        self._rewards = np.empty((steps, num_envs), np.float32)
        self._terminated = np.zeros((steps, num_envs), np.bool_)
        self._done = np.zeros((steps, num_envs), np.bool_)
        self._columns: dict[str, Array] = {}
        self._finals: dict[tuple[int, int], Array] = {}
        self._action_space = action_space
        self._steps, self._taken = steps, 0

    def add(
        self,
        columns: dict[str, Array],
        observation: Array,
        rewards: Array,
        terminated: Array,
        truncated: Array,
        finals: dict[int, Array],
    ) -> None:
        """Add a step.

        Args:
            columns: Actions and all other outputs of the module (num_envs, …).
            observation: Observations after the step (num_envs, k). For each episode that ended, this array contains
                the first observation of the next episode.
            rewards: Rewards (num_envs,).
            terminated: Whether the task terminated the episode of each environment (num_envs,).
            truncated: Whether the episode of each environment was truncated (num_envs,).
            finals: Final observation (k,) of each episode that ended, by the index of its environment.
        """
        step = self._taken
        for name, values in columns.items():
            if name not in self._columns:
                self._columns[name] = np.empty((self._steps, *values.shape), values.dtype)
            self._columns[name][step] = values
        self._observations[step + 1] = observation
        self._rewards[step] = rewards
        self._terminated[step] = terminated
        self._done[step] = terminated | truncated
        self._finals |= {(step, env): final for env, final in finals.items()}
        self._taken += 1

    def episodes(self) -> list[SingleAgentEpisode]:
        """Return the fragments, ordered by environment."""
        pieces = []
        last = self._taken - 1
        for env in range(self._observations.shape[1]):
            ends = np.flatnonzero(self._done[: self._taken, env]).tolist()
            if not ends or ends[-1] != last:
                ends.append(last)
            start = 0
            for end in ends:
                pieces.append(self._piece(env, start, end + 1))
                start = end + 1
        return pieces

    def _piece(self, env: int, start: int, stop: int) -> SingleAgentEpisode:
        """Return an environment's steps ``start`` to ``stop − 1``, including the observation after the last step."""
        observations = self._observations[start : stop + 1, env].copy()
        final = self._finals.get((stop - 1, env))
        if final is not None:
            observations[-1] = final
        columns = {name: InfiniteLookbackBuffer(values[start:stop, env]) for name, values in self._columns.items()}
        actions = columns.pop(Columns.ACTIONS)
        done, terminated = bool(self._done[stop - 1, env]), bool(self._terminated[stop - 1, env])
        return SingleAgentEpisode(
            uuid.uuid4().hex,
            observations=InfiniteLookbackBuffer(observations),
            infos=InfiniteLookbackBuffer([_NOTHING] * len(observations)),
            actions=actions,
            rewards=InfiniteLookbackBuffer(self._rewards[start:stop, env]),
            terminated=terminated,
            truncated=done and not terminated,
            extra_model_outputs=columns,
            t_started=0,
            len_lookback_buffer=0,
        )
