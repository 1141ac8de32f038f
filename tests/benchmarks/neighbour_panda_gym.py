"""Train one of panda-gym's environments with hindsight replay.

``neighbours.py`` runs this script in panda-gym's own virtual environment, so it imports nothing from FRobs::

    python neighbour_panda_gym.py ID SEED EPISODES THRESHOLD SECONDS

The last line of the output is JSON: steps, seconds of training, and success at each evaluation.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import panda_gym
import torch
from sb3_contrib import TQC
from sb3_contrib.common.wrappers import TimeFeatureWrapper
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.callbacks import BaseCallback

HINDSIGHT = {"n_sampled_goal": 4, "goal_selection_strategy": "future"}


@dataclass(frozen=True)
class Case:
    """A training run.

    Attributes:
        algorithm: Class of the algorithm.
        settings: Keyword arguments of the algorithm.
        seconds: Training time between evaluations [s].
        threads: Number of PyTorch threads.
        time_feature: Whether the observation contains the remaining time.
    """

    algorithm: type[SAC | TQC]
    settings: Mapping[str, Any]
    seconds: float
    threads: int
    time_feature: bool = False

    def make(self, id: str) -> gym.Env[Any, Any]:
        """Create an environment."""
        env = gym.make(id)
        return TimeFeatureWrapper(env) if self.time_feature else env


REACH = Case(
    SAC,
    {
        "learning_rate": 1e-3,
        "gamma": 0.95,
        "batch_size": 256,
        "buffer_size": 100_000,
        "learning_starts": 500,
        "policy_kwargs": {"net_arch": [64, 64]},
    },
    seconds=2.0,
    threads=1,  # as in FRobs: small networks are slower on two threads
)
"""Small networks and a short horizon, as in the published tuned settings for this task."""

OBJECT = Case(
    TQC,
    {
        "learning_rate": 1e-3,
        "gamma": 0.95,
        "tau": 0.05,
        "batch_size": 2048,
        "buffer_size": 1_000_000,
        "policy_kwargs": {"net_arch": [512, 512, 512], "n_critics": 2},
    },
    seconds=300.0,
    threads=len(os.sched_getaffinity(0)),
    time_feature=True,
)
"""The settings of rl-baselines3-zoo for the tasks with a cube."""

CASES = {"PandaReach-v3": REACH, "PandaPush-v3": OBJECT, "PandaPickAndPlace-v3": OBJECT}


class Stopwatch(BaseCallback):
    """Evaluates at regular intervals, and excludes the evaluations from the training time."""

    def __init__(self, id: str, seed: int, episodes: int, threshold: float, limit: float) -> None:
        super().__init__()
        self._case = CASES[id]
        self._env = self._case.make(id)
        self._env.reset(seed=1_000_000 + seed)  # goals that do not occur in training
        self._episodes, self._threshold, self._limit = episodes, threshold, limit
        self._paused = 0.0
        self.moments: list[dict[str, float]] = []

    def _on_training_start(self) -> None:
        self._start = time.perf_counter()
        self._next = self._case.seconds

    def _on_step(self) -> bool:
        paused = time.perf_counter()
        seconds = paused - self._start - self._paused
        if seconds < self._next:
            return True
        success = self._evaluate()
        self._paused += time.perf_counter() - paused
        self._next += self._case.seconds
        self.moments.append({"steps": self.num_timesteps, "seconds": seconds, "success": success})
        sys.stderr.write(f"{self.moments[-1]}\n")
        return success < self._threshold and seconds < self._limit

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


def main(id: str, seed: int, episodes: int, threshold: float, limit: float) -> None:
    """Train until the threshold or the time limit [s] is reached, and print the results."""
    assert panda_gym.__version__
    case = CASES[id]
    torch.set_num_threads(case.threads)
    watch = Stopwatch(id, seed, episodes, threshold, limit)
    model = case.algorithm(
        "MultiInputPolicy",
        case.make(id),
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs=HINDSIGHT,
        seed=seed,
        **case.settings,
    )
    model.learn(10**9, callback=watch)
    sys.stdout.write(f"\n{json.dumps(watch.moments)}\n")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]), float(sys.argv[5]))
