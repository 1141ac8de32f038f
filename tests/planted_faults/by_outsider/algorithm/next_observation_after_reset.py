"""The next observation of the last step of an episode is the first one of the next episode, not the final one."""

from __future__ import annotations

import numpy as np

from frobs_algos_sb3.td3 import TD3


class Faulty(TD3):
    def _build(self, env, config, seed, scale):
        super()._build(env, config, seed, scale)
        wait = self.venv.step_wait

        def step_wait():
            observation, reward, done, infos = wait()
            for row in np.flatnonzero(done):
                infos[row]["terminal_observation"] = observation[row]
            return observation, reward, done, infos

        self.venv.step_wait = step_wait
