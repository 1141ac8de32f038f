"""With several episodes per sample, the mean reward of a sample is taken over episodes of other samples."""

from __future__ import annotations

import numpy as np

from templates.algorithm import CrossEntropy


class Faulty(CrossEntropy):
    def _play(self, env, draws):
        episodes = np.tile(np.arange(len(draws)), self._config.episodes)
        rewards = np.zeros(len(episodes))
        playing = np.arange(env.num_envs)
        begun, ended = env.num_envs, 0
        observation, _ = env.reset()
        while ended < len(episodes):
            busy = playing < len(episodes)
            weights = draws[episodes[np.where(busy, playing, 0)]]
            actions = self._act(weights, np.asarray(observation, np.float64))
            observation, reward, terminated, truncated, _ = env.step(actions)
            self._steps += env.num_envs
            rewards[playing[busy]] += reward[busy]
            done = busy & (terminated | truncated)
            count = int(done.sum())
            playing[done] = np.arange(begun, begun + count)
            begun, ended = begun + count, ended + count
        return rewards.reshape(len(draws), -1).mean(axis=1)
