"""Wrappers and callbacks that the tests' configurations name."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from frobs_train import TrainingCallback


class Doubled(gym.RewardWrapper[Any, Any]):
    """Doubles the reward, or so."""

    def __init__(self, env: gym.Env[Any, Any], factor: float = 2.0) -> None:
        super().__init__(env)
        self.factor = factor

    def reward(self, reward: Any) -> Any:
        return self.factor * reward


class DoubledVector(gym.vector.VectorRewardWrapper):
    """The same for vectors."""

    def rewards(self, reward: Any) -> Any:
        return 2.0 * reward


class Counting(gym.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """Pays how often it was stepped, and saves that."""

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self.count = np.zeros(1)

    def step(self, actions: Any) -> Any:
        observation, reward, *rest = self.env.step(actions)
        self.count += 1
        return observation, reward + self.count, *rest

    def snapshot(self) -> dict[str, Any]:
        return {"count": self.count.copy()}

    def restore(self, snapshot: Any) -> None:
        self.count[:] = snapshot["count"]


class Diary(TrainingCallback):
    """Writes down what it is told."""

    entries: list[str] = []  # noqa: RUF012 - the test reads it, which does not build it

    def __init__(self, stop_at: int | None = None) -> None:
        self.stop_at = stop_at

    def on_start(self, run: Any, steps: int) -> None:
        self.entries.append(f"start {steps}")

    def on_progress(self, progress: Any, row: Any) -> bool | None:
        self.entries.append(f"row {row['train/steps']}")
        return None if self.stop_at is None else progress.steps < self.stop_at

    def on_checkpoint(self, checkpoint: Any) -> None:
        self.entries.append(f"checkpoint {checkpoint.steps}")

    def on_end(self, run: Any, steps: int) -> None:
        self.entries.append(f"end {steps}")


def no_callback() -> object:
    return object()
