"""An episode that is cut off by the time limit is learned from as if it had ended in a terminal state."""

from __future__ import annotations

from stable_baselines3.common.vec_env import VecEnvWrapper

from frobs_algos_sb3.ppo import PPO


class _Done(VecEnvWrapper):
    def reset(self):
        return self.venv.reset()

    def step_wait(self):
        observation, rewards, done, infos = self.venv.step_wait()
        return (
            observation,
            rewards,
            done,
            [{k: v for k, v in info.items() if k != "TimeLimit.truncated"} for info in infos],
        )


class Faulty(PPO):
    def _adapt(self, venv):
        return _Done(super()._adapt(venv))
