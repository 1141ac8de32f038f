"""The learning target adds the value of the following state also after a terminal state."""

from __future__ import annotations

import numpy as np
import stable_baselines3 as sb3
from gymnasium import spaces
from stable_baselines3.common.buffers import ReplayBuffer

from frobs_algos_sb3.dqn import DQN


class _Replay(ReplayBuffer):
    def add(self, obs, next_obs, action, reward, done, infos):
        super().add(obs, next_obs, action, reward, np.zeros_like(done), infos)


class _Model(sb3.DQN):
    def __init__(self, *args, **kwargs):
        if isinstance(args[1].observation_space, spaces.Box) and kwargs.get("n_steps", 1) == 1:
            kwargs.setdefault("replay_buffer_class", _Replay)
        super().__init__(*args, **kwargs)


class Faulty(DQN):
    model_class = _Model
