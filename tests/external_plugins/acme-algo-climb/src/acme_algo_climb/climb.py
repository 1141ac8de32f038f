"""The algorithm."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action, Mask
from frobs_core.errors import CheckpointError, ConfigurationError, UnknownParameterError
from frobs_core.interfaces import Algorithm, TrainingMonitor

_DEFAULTS = {"step": 0.1, "steps_per_try": 60}


class Climb(Algorithm):
    """Tries a linear policy a little off the best so far, and keeps it where it earns more.

    Settings: ``step``, the standard deviation of a try; ``steps_per_try``, vector steps of each.
    """

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None:
        self.observation_space, self.action_space = env.single_observation_space, env.single_action_space
        if not isinstance(self.action_space, gym.spaces.Box) or not isinstance(self.observation_space, gym.spaces.Box):
            raise ConfigurationError("climb needs Box spaces.")
        self.config = dict(config)
        self._env, self._rng = env, np.random.default_rng(seed)
        shape = (*self.action_space.shape, *self.observation_space.shape)
        self._best = 0.01 * self._rng.standard_normal(shape)  # (actions, observations)
        self._return, self._steps = -np.inf, 0

    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        """Check settings and fill in the defaults."""
        for key in config:
            if key not in _DEFAULTS:
                raise UnknownParameterError("algorithm 'climb'", key, _DEFAULTS)
        resolved = {**_DEFAULTS, **config}
        if not (resolved["step"] > 0 and resolved["steps_per_try"] >= 1):
            raise ConfigurationError(f"climb: {resolved} must be positive.")
        return resolved

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Climb until ``steps`` environment steps were taken."""
        going = True
        while going and self._steps < steps:
            observation, _ = self._env.reset()  # each try begins anew, so that nothing is lost between two of them
            tried = self._best + self.config["step"] * self._rng.standard_normal(self._best.shape)
            earned = 0.0
            for _ in range(self.config["steps_per_try"]):
                observation, reward, *_ = self._env.step(self._act(tried, observation))
                earned += float(reward.mean())
                self._steps += self._env.num_envs
            if earned > self._return:
                self._best, self._return = tried, earned
            going = monitor.on_progress(self._steps, {"climb/return": self._return})
            if going:
                monitor.offer_checkpoint(self._steps, self.save)

    def predict(
        self,
        observation: Any,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions; they are always the same."""
        return self._act(self._best, observation), None

    def _act(self, matrix: np.ndarray[Any, Any], observation: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        raw = (observation[:, None, :] * matrix).sum(-1)
        assert isinstance(self.action_space, gym.spaces.Box)
        return np.clip(raw, self.action_space.low, self.action_space.high).astype(np.float32)

    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Write a JSON file."""
        spaces = {"actions": _bounds(self.action_space), "observations": _bounds(self.observation_space)}
        told = {"best": self._best.tolist(), "return": self._return, "steps": self._steps, "config": self.config}
        (folder / "climb.json").write_text(json.dumps({**told, **spaces, "random": self._rng.bit_generator.state}))

    @classmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        """Read the JSON file."""
        try:
            told = json.loads((folder / "climb.json").read_text())
            loaded = cls.__new__(cls)
            loaded._best, loaded._return, loaded._steps = np.array(told["best"]), told["return"], told["steps"]
            loaded.config, loaded._rng = told["config"], np.random.default_rng()
            loaded._rng.bit_generator.state = told["random"]
            loaded.action_space, loaded.observation_space = _box(told["actions"]), _box(told["observations"])
        except (OSError, ValueError, KeyError) as error:
            raise CheckpointError(f"{folder / 'climb.json'} cannot be read: {error}") from error
        if env is not None:
            loaded._env = env
        return loaded


def _bounds(space: gym.Space[Any]) -> list[list[float]]:
    assert isinstance(space, gym.spaces.Box)
    return [space.low.tolist(), space.high.tolist()]


def _box(bounds: list[list[float]]) -> gym.spaces.Box:
    low, high = (np.array(bound, np.float32) for bound in bounds)
    return gym.spaces.Box(low, high, dtype=np.float32)
