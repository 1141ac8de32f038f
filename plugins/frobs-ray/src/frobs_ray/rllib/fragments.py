"""Conversion of steps from many environments to RLlib's episodes."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from ray.rllib.core.columns import Columns
from ray.rllib.env.single_agent_episode import SingleAgentEpisode
from ray.rllib.env.utils.infinite_lookback_buffer import InfiniteLookbackBuffer

Array = np.ndarray[Any, Any]
_NOTHING: dict[str, Any] = {}
"""The ``info`` of every step. All steps share this dictionary, which is neither read nor modified."""


class Step(NamedTuple):
    """One step of all environments."""

    outputs: Mapping[str, Array]  # actions and all other outputs of the module by RLlib's column name, (num_envs, …)
    observation: Array  # after the step, (num_envs, k); where an episode ended, the first one of the next episode
    reward: Array  # (num_envs,)
    terminated: Array  # whether the task terminated the episode, (num_envs,) bool
    truncated: Array  # whether the episode was truncated, (num_envs,) bool
    finals: Mapping[int, Array]  # final observation (k,) of each episode that ended, by the index of its environment


def fragments(first: Array, steps: Sequence[Step]) -> list[SingleAgentEpisode]:
    """Return the fragments of episodes in consecutive steps, ordered by environment.

    Args:
        first: Observations before the first step, (num_envs, k).
        steps: The steps.
    """
    observations = np.stack([first, *(step.observation for step in steps)])  # (steps + 1, num_envs, k)
    rewards = np.stack([step.reward for step in steps], dtype=np.float32)  # (steps, num_envs)
    outputs = {name: np.stack([step.outputs[name] for step in steps]) for name in steps[0].outputs}
    ended = np.stack([step.terminated | step.truncated for step in steps])
    ended[-1] = True
    pieces = []
    for env in range(observations.shape[1]):
        start = 0
        for last in np.flatnonzero(ended[:, env]).tolist():
            rows, step = slice(start, last + 1), steps[last]
            seen = observations[start : last + 2, env].copy()
            seen[-1] = step.finals.get(env, seen[-1])
            columns = {name: InfiniteLookbackBuffer(values[rows, env]) for name, values in outputs.items()}
            pieces.append(
                SingleAgentEpisode(
                    uuid.uuid4().hex,
                    observations=InfiniteLookbackBuffer(seen),
                    infos=InfiniteLookbackBuffer([_NOTHING] * len(seen)),
                    actions=columns.pop(Columns.ACTIONS),
                    rewards=InfiniteLookbackBuffer(rewards[rows, env]),
                    terminated=bool(step.terminated[env]),
                    truncated=bool(step.truncated[env] and not step.terminated[env]),
                    extra_model_outputs=columns,
                    t_started=0,
                    len_lookback_buffer=0,
                )
            )
            start = last + 1
    return pieces
