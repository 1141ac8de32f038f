"""The cross-entropy method as a plugin: a complete algorithm to copy and modify.

The method samples the weights of a small network from a normal distribution, runs episodes with each sample, and moves
the distribution toward the best samples (de Boer et al. 2005). Noise is added to the standard deviation, as in Szita
and Lőrincz (2006). The framework provides everything else: the command line, the log, checkpoints, evaluation, plots
and comparison.

To package it as a distribution, put the algorithm and its record into separate modules. The record at the end is the
plugin, and the entry point names its module::

    [project.entry-points.frobs]
    my_algorithms = "my_package.plugin"
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, Self

import gymnasium as gym
import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from frobs_core.contracts import Algorithm, TrainingMonitor
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import CheckpointError, IncompatibleSpaceError, RunError
from frobs_core.util.files import write_json
from frobs_core.util.plain import read_numbers, spell_numbers
from frobs_core.util.validation import validate

FORMAT = 1


class CrossEntropyConfig(BaseModel):
    """Settings.

    Attributes:
        population: Number of samples per iteration.
        elite: Fraction of the samples that form the elite, toward which the distribution moves.
        episodes: Number of episodes per sample; a sample's score is its mean reward.
        hidden: Width of the hidden layer, or 0 for a linear policy.
        initial_deviation: Initial standard deviation of each weight.
        extra_deviation: Amount that is added to the elite's standard deviation. It decreases to 0 over the first half
            of the training run. Without this amount, the distribution would narrow before it has explored enough.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    population: int = Field(default=32, ge=2)
    elite: float = Field(default=0.25, gt=0.0, le=1.0)
    episodes: int = Field(default=1, ge=1)
    hidden: int = Field(default=0, ge=0)
    initial_deviation: float = Field(default=1.0, gt=0.0)
    extra_deviation: float = Field(default=0.25, ge=0.0)


class CrossEntropy(Algorithm):
    """The cross-entropy method over the weights of a linear policy or a network with one hidden layer."""

    name = "cross_entropy"

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: CrossEntropyConfig, seed: int) -> None:
        self._build(env.single_observation_space, env.single_action_space, config)
        self._env: gym.vector.VectorEnv[Any, Any, Any] | None = env
        self._rng = np.random.default_rng(seed)
        self._mean = np.zeros(self._num_weights)  # (weights,)
        self._deviation = np.full(self._num_weights, config.initial_deviation)  # (weights,)
        self._steps = 0

    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> CrossEntropyConfig:
        """Validate the settings and fill in the defaults."""
        return validate(CrossEntropyConfig, config, f"algorithm '{cls.name}'")

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Train for ``steps`` environment steps. The last iteration is always completed."""
        if self._env is None:
            raise RunError(
                "this algorithm was loaded for prediction only; load it with an environment to continue training."
            )
        while self._steps < steps:
            draws = self._rng.normal(self._mean, self._deviation, (self._config.population, self._num_weights))
            rewards = self._play(self._env, draws)
            metrics = self._learn(draws, rewards, self._steps / steps)
            if not monitor.is_due(self._steps) and self._steps < steps:
                continue
            go_on = monitor.on_progress(self._steps, metrics)
            # The next iteration depends only on self and the environment, so a checkpoint can be saved here.
            monitor.offer_checkpoint(self._steps, self.save)
            if not go_on:
                return

    def predict(
        self,
        observation: Any,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: np.ndarray[Any, Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[Any, None]:
        """Return the actions of the mean network if deterministic, otherwise of random networks."""
        seen = np.asarray(observation, np.float64)  # (n, k)
        weights = np.broadcast_to(self._mean, (len(seen), self._num_weights))
        if not deterministic:  # uses a separate generator, because predictions must not affect training
            weights = np.random.default_rng().normal(weights, self._deviation)
        return self._act(weights, seen), None

    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Write the settings and the generator state as JSON, and the distribution as plain arrays."""
        content = {
            "format": FORMAT,
            "config": self._config.model_dump(mode="json"),
            "steps": self._steps,
            "generator": self._rng.bit_generator.state,
            "observation_space": _space_to_json(self.observation_space),
            "action_space": _space_to_json(self.action_space),
        }
        write_json(folder / "algorithm.json", spell_numbers(content))
        with (folder / "distribution.npz").open("wb") as file:
            np.savez(file, allow_pickle=False, mean=self._mean, deviation=self._deviation)

    @classmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        """Load a folder written by :meth:`save`. If an environment is given, training can continue."""
        self = cls.__new__(cls)
        try:
            content = read_numbers(json.loads((folder / "algorithm.json").read_text("utf-8")))
            if content["format"] != FORMAT:
                raise CheckpointError(f"{folder} has format {content['format']}, but {FORMAT} is required.")
            observed, acted = _space_from_json(content["observation_space"]), _space_from_json(content["action_space"])
            self._build(observed, acted, cls.resolve_config(content["config"]))
            self._env, self._steps = env, content["steps"]
            self._rng = np.random.default_rng()
            self._rng.bit_generator.state = content["generator"]
            with (folder / "distribution.npz").open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                self._mean, self._deviation = arrays["mean"], arrays["deviation"]
        except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
            raise CheckpointError(f"{folder} cannot be read: {type(error).__name__}: {error}.") from error
        return self

    def _build(
        self, observation_space: gym.Space[Any], action_space: gym.Space[Any], config: CrossEntropyConfig
    ) -> None:
        """Set the values that depend on the spaces and the settings."""
        if not isinstance(observation_space, gym.spaces.Box) or len(observation_space.shape) != 1:
            raise IncompatibleSpaceError(
                self.name, observation_space, f"requires flat observations, not {observation_space}."
            )
        if isinstance(action_space, gym.spaces.Box) and not action_space.is_bounded():
            raise IncompatibleSpaceError(self.name, action_space, f"requires actions with bounds, not {action_space}.")
        self.observation_space, self.action_space, self._config = observation_space, action_space, config
        choices = action_space.n if isinstance(action_space, gym.spaces.Discrete) else None
        outputs = int(np.prod(action_space.shape or ()) if choices is None else choices)
        widths = [observation_space.shape[0], *([config.hidden] if config.hidden else []), outputs]
        self._layers = [(above + 1, below) for above, below in pairwise(widths)]  # + 1 for the bias
        self._num_weights = sum(rows * columns for rows, columns in self._layers)

    def _play(self, env: gym.vector.VectorEnv[Any, Any, Any], draws: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """Return the mean episode reward of each sample, (draws,).

        Each environment runs one episode after another. When an episode begins, it is assigned to the next sample.
        """
        episodes = np.repeat(np.arange(len(draws)), self._config.episodes)  # sample used in each episode
        rewards = np.zeros(len(episodes))
        playing = np.arange(env.num_envs)  # episode index of each environment, which idles after its last episode
        begun, ended = env.num_envs, 0
        observation, _ = env.reset()
        while ended < len(episodes):
            busy = playing < len(episodes)
            weights = draws[episodes[np.where(busy, playing, 0)]]  # (num_envs, weights)
            actions = self._act(weights, np.asarray(observation, np.float64))
            observation, reward, terminated, truncated, _ = env.step(actions)
            self._steps += env.num_envs
            rewards[playing[busy]] += reward[busy]
            done = busy & (terminated | truncated)  # the environment has already begun its next episode
            count = int(done.sum())
            playing[done] = np.arange(begun, begun + count)
            begun, ended = begun + count, ended + count
        means: np.ndarray[Any, Any] = rewards.reshape(len(draws), -1).mean(axis=1)
        return means

    def _learn(self, draws: np.ndarray[Any, Any], rewards: np.ndarray[Any, Any], progress: float) -> dict[str, float]:
        """Move the distribution toward the elite, and return metrics for the log."""
        best = np.argsort(-rewards, kind="stable")[: max(1, round(self._config.elite * len(draws)))]
        self._mean = draws[best].mean(axis=0)
        extra = self._config.extra_deviation * max(0.0, 1.0 - 2.0 * progress)
        self._deviation = draws[best].std(axis=0) + extra
        return {
            f"{self.name}/reward_of_population": float(rewards.mean()),
            f"{self.name}/reward_of_elite": float(rewards[best].mean()),
            f"{self.name}/deviation": float(self._deviation.mean()),
        }

    def _act(self, weights: np.ndarray[Any, Any], observation: np.ndarray[Any, Any]) -> Any:
        """Return the actions of a separate network for each observation: weights (n, weights), observation (n, k)."""
        values, start = observation, 0
        for index, (rows, columns) in enumerate(self._layers):
            layer = weights[:, start : start + rows * columns].reshape(-1, rows, columns)
            values = np.einsum("nk,nkm->nm", np.tanh(values) if index else values, layer[:, :-1]) + layer[:, -1]
            start += rows * columns
        space: Any = self.action_space
        if isinstance(space, gym.spaces.Discrete):
            return space.start + values.argmax(axis=1)  # (n,)
        middle, half = (space.high + space.low) / 2.0, (space.high - space.low) / 2.0
        actions = middle + half * np.tanh(values).reshape(-1, *space.shape)  # (n, …)
        return np.clip(actions, space.low, space.high).astype(space.dtype)  # rounding may exceed the bounds


def _space_to_json(space: Any) -> dict[str, Any]:
    if isinstance(space, gym.spaces.Discrete):
        return {"n": int(space.n), "start": int(space.start)}
    return {"low": space.low.tolist(), "high": space.high.tolist(), "dtype": str(space.dtype)}


def _space_from_json(content: Mapping[str, Any]) -> gym.Space[Any]:
    if "n" in content:
        return gym.spaces.Discrete(content["n"], start=content["start"])
    dtype = np.dtype(content["dtype"])
    return gym.spaces.Box(np.array(content["low"], dtype), np.array(content["high"], dtype), dtype=dtype.type)


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Provide the algorithm. This function is the plugin. A packaged plugin should avoid heavy top-level imports."""
    return [
        AlgorithmRecord(
            name=CrossEntropy.name,
            summary="cross-entropy method over a small network",
            entry_point=f"{__name__}:{CrossEntropy.__name__}",
            install_hint="pip install my-algorithms",
            action_spaces=("Box", "Discrete"),
        )
    ]
