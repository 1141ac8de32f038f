"""The rollout stores the actions after clipping, together with the probabilities of the actions before clipping."""

from __future__ import annotations

import numpy as np
import stable_baselines3 as sb3
from gymnasium import spaces
from stable_baselines3.common.buffers import RolloutBuffer

from frobs_algos_sb3.ppo import PPO


class _Rollout(RolloutBuffer):
    def add(self, obs, action, reward, episode_start, value, log_prob):
        if isinstance(self.action_space, spaces.Box):
            action = np.clip(action, self.action_space.low, self.action_space.high)
        super().add(obs, action, reward, episode_start, value, log_prob)


class _Model(sb3.PPO):
    def __init__(self, *args, **kwargs):
        if isinstance(args[1].observation_space, spaces.Box):
            kwargs["rollout_buffer_class"] = _Rollout
        super().__init__(*args, **kwargs)


class Faulty(PPO):
    model_class = _Model
