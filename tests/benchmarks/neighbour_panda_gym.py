"""Train panda-gym's PandaReach-v3 with SAC and hindsight replay.

``neighbours.py`` runs this script in panda-gym's own virtual environment, so it imports nothing from FRobs::

    python neighbour_panda_gym.py SEED STEPS EPISODES THRESHOLD

The last line of the output is JSON: steps, seconds of training, and success at each evaluation.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import gymnasium as gym
import panda_gym
import torch
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.callbacks import BaseCallback

ID = "PandaReach-v3"
EVERY = 500  # environment steps between evaluations
SETTINGS: dict[str, Any] = {
    "learning_rate": 1e-3,
    "gamma": 0.95,
    "batch_size": 256,
    "buffer_size": 100_000,
    "learning_starts": 500,
    "policy_kwargs": {"net_arch": [64, 64]},
    "replay_buffer_kwargs": {"n_sampled_goal": 4, "goal_selection_strategy": "future"},
}
"""Small networks and a short horizon, as in the published tuned settings for this task."""


class Stopwatch(BaseCallback):
    """Evaluates at regular intervals, and excludes the evaluations from the training time."""

    def __init__(self, seed: int, episodes: int, threshold: float) -> None:
        super().__init__()
        self._env = gym.make(ID)
        self._env.reset(seed=1_000_000 + seed)  # goals that do not occur in training
        self._episodes, self._threshold = episodes, threshold
        self._paused = 0.0
        self.moments: list[dict[str, float]] = []

    def _on_training_start(self) -> None:
        self._start = time.perf_counter()

    def _on_step(self) -> bool:
        if self.num_timesteps % EVERY:
            return True
        paused = time.perf_counter()
        success = self._evaluate()
        seconds = paused - self._start - self._paused
        self._paused += time.perf_counter() - paused
        self.moments.append({"steps": self.num_timesteps, "seconds": seconds, "success": success})
        return success < self._threshold

    def _evaluate(self) -> float:
        reached = 0.0
        for _ in range(self._episodes):
            observation, info = self._env.reset()
            done = False
            while not done:
                action, _ = self.model.predict(observation, deterministic=True)
                observation, _, terminated, truncated, info = self._env.step(action)
                done = terminated or truncated
            reached += float(info["is_success"])
        return reached / self._episodes


def main(seed: int, steps: int, episodes: int, threshold: float) -> None:
    """Train until the threshold is reached, and print the results."""
    assert panda_gym.__version__
    torch.set_num_threads(1)  # as in FRobs: small networks are slower on two threads
    watch = Stopwatch(seed, episodes, threshold)
    model = SAC("MultiInputPolicy", gym.make(ID), replay_buffer_class=HerReplayBuffer, seed=seed, **SETTINGS)
    model.learn(steps, callback=watch)
    sys.stdout.write(f"\n{json.dumps(watch.moments)}\n")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]))
