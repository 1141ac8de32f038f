"""The base class of all algorithms from stable-baselines3."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import gymnasium as gym
import numpy as np
import torch as th
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.preprocessing import is_image_space
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from frobs_algos import storage
from frobs_algos.algorithm import PolicyAlgorithm
from frobs_algos.demonstrations import Demonstrations
from frobs_algos.spaces import space_to_json, subspaces
from frobs_algos_sb3 import replay, state
from frobs_algos_sb3.callback import MonitorCallback, Stopped
from frobs_algos_sb3.config import SB3Config
from frobs_algos_sb3.features import ScaledFlattenExtractor
from frobs_algos_sb3.spaces import check_observation_space
from frobs_algos_sb3.vec_env import VectorEnvAdapter
from frobs_core.contracts import TrainingMonitor
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import ConfigurationError, IncompatibleSpaceError, NonFiniteValueError
from frobs_core.util.memory import require_memory

if TYPE_CHECKING:
    from frobs_algos.onnx_policy import PolicyGraph

_FIXED = (
    *("policy_kwargs", "scale_observation", "normalize_observation", "normalize_reward", "use_sde"),
    *("buffer_size", "replay_buffer", "optimize_memory_usage", "n_steps"),
    *("demonstrations", "demonstration_episodes", "demonstration_mapping"),
)
"""Settings that cannot change during training, because networks, optimizers or buffers depend on them."""


class SB3Algorithm(PolicyAlgorithm):
    """Base class of all algorithms. Each subclass sets ``name``, ``config_model`` and ``model_class``.

    Attributes:
        model_class: Class of the model in stable-baselines3.
        model: Instance of ``model_class``.
        venv: Environment adapted to stable-baselines3, before normalization.
        normalizer: Wrapper that normalizes observations and rewards, or None if the settings do not request
            normalization.
    """

    format: ClassVar[int] = 2
    model_class: ClassVar[type[BaseAlgorithm]]

    model: BaseAlgorithm
    venv: VectorEnvAdapter
    normalizer: VecNormalize | None

    _config: SB3Config
    _pause: state.Pause | None
    _sampling: state.Arrays | None  # random state of sampled predictions
    _callback: MonitorCallback | None

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        self._require_env()
        left = steps - self.model.num_timesteps
        if left <= 0:
            return
        if self._pause is not None and not self._pause.at_start:
            self._begin()
        callback = MonitorCallback(self.name, monitor, self._begin, self.save)
        self._callback = callback
        try:
            with _named_divergence(self.name):
                self.model.learn(left, callback, log_interval=None, reset_num_timesteps=self.model.num_timesteps == 0)  # type: ignore[arg-type]
        except Stopped:
            self._pause = state.Pause(self._draws(), at_start=True)
            return
        finally:
            self._callback = None
        callback.report()

    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        observation = self._seen(observation)
        with _named_divergence(self.name):
            if deterministic:
                return self.model.predict(observation, state, episode_start, deterministic)
            return self._sample(observation, state, episode_start)

    def _sample(
        self,
        observation: Observation,
        last_state: tuple[np.ndarray[Any, Any], ...] | None,
        episode_start: Mask | None,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return sampled actions and the next policy state, without changing the random state of training."""
        training = self._draws()
        if self._sampling is not None:
            self._restore_draws(self._sampling)
        try:
            return self.model.predict(observation, last_state, episode_start, deterministic=False)
        finally:
            self._sampling = self._draws()
            self._restore_draws(training)

    def save(self, folder: Path, previous: Path | None = None) -> None:
        super().save(folder, previous)
        self._write_learning(folder)
        storage.write_arrays(folder / "last_step.npz", state.last_step(self.model))
        storage.write_arrays(folder / "random.npz", self._current_pause().arrays)
        buffer = getattr(self.model, "replay_buffer", None)
        if buffer is not None:
            replay.write(buffer, folder / "replay", None if previous is None else previous / "replay")

    def save_policy(self, folder: Path) -> None:
        """Save only the policy: ``algorithm.json``, the networks and the normalizer."""
        super().save_policy(folder)
        if self.normalizer is not None:
            storage.write_arrays(folder / "normalizer.npz", state.normalizer_arrays(self.normalizer))

    @classmethod
    def load_with(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any]) -> Self:
        return cls._load(folder, env, config)

    def forget_episodes(self) -> None:
        self.model._last_obs = None
        truncate = getattr(getattr(self.model, "replay_buffer", None), "truncate_last_trajectory", None)
        if truncate is not None:  # end the unfinished episodes of hindsight replay
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                truncate()

    def timed_parts(self) -> dict[str, list[tuple[object, str]]]:
        model: Any = self.model
        rollout = getattr(model, "rollout_buffer", None)
        if rollout is None:  # off-policy
            inference, storage = [(model, "_sample_action")], [(model, "_store_transition")]
        else:
            storage = [(rollout, name) for name in ("reset", "add", "compute_returns_and_advantage")]
            inference = [(model.policy, "forward"), (model.policy, "predict_values")]
            if hasattr(model.policy, "predict_all"):  # sbx
                inference = [(model.policy, "predict_all"), (model.vf, "apply")]
        return {"inference": inference, "updates": [(model, "train")], "storage": storage}

    @property
    def _network(self) -> th.nn.Module:
        return self.model.policy

    def _policy_graph(self) -> PolicyGraph:
        from frobs_algos_sb3.onnx import policy_graph

        return policy_graph(self.model, self.normalizer, self.observation_space)

    def _progress(self) -> dict[str, Any]:
        return {"counters": state.counters(self.model), "at_start": self._current_pause().at_start}

    def _current_pause(self) -> state.Pause:
        """Return the random state from which training continues."""
        return self._pause or state.Pause(self._draws(), self._callback is not None and self._callback.at_start)

    @classmethod
    def _changed(cls, before: SB3Config, after: SB3Config) -> SB3Config:
        for name in _FIXED:
            old, new = getattr(before, name, None), getattr(after, name, None)
            if old != new:
                raise ConfigurationError(
                    f"algorithm_config.{name} cannot change from {old} to {new} during training, because networks or "
                    "buffers depend on it; start a new run."
                )
        return after

    def _build(
        self, env: gym.vector.VectorEnv[Any, Any, Any], config: SB3Config, seed: int, scale: list[float] | None
    ) -> None:
        super()._build(env, config, seed, scale)
        self._pause, self._sampling, self._callback = None, None, None
        self._check_observation_space(config)
        space_to_json(self.observation_space)  # this call raises an error for unsupported spaces
        self._check_action_space(self.action_space)
        self._set_threads(config)
        self.venv = VectorEnvAdapter(env)
        adapted = self._adapt(self.venv)
        self.normalizer = None
        if config.normalize_observation or config.normalize_reward:
            vectors = [key for key, part in subspaces(adapted.observation_space).items() if not is_image_space(part)]
            self.normalizer = VecNormalize(
                adapted,
                norm_obs=config.normalize_observation and bool(vectors),  # the networks divide pictures by 255
                norm_obs_keys=vectors if isinstance(adapted.observation_space, spaces.Dict) else None,
                norm_reward=config.normalize_reward,
                clip_obs=config.clip_observation,
                clip_reward=config.clip_reward,
                gamma=config.gamma,
            )
        # Do not pass the seed to the model, because the model would also seed the environment.
        set_random_seed(seed, using_cuda=config.device != "cpu")
        self.action_space.seed(seed)
        self._env = self.normalizer or adapted
        self.model = self._make_model(self._policy(), **self._model_kwargs())
        self.model.set_logger(Logger(folder=None, output_formats=[]))

    def _adapt(self, venv: VecEnv) -> VecEnv:
        """Return the environment, with observations converted to a form that the networks accept."""
        return venv

    def _policy(self) -> str:
        if isinstance(self.observation_space, spaces.Dict):
            return "MultiInputPolicy"
        return "CnnPolicy" if is_image_space(self.observation_space) else "MlpPolicy"

    def _set_threads(self, config: SB3Config) -> None:
        th.set_num_threads(config.torch_threads)

    def _model_kwargs(self) -> dict[str, Any]:
        """Return the keyword arguments of the model's class, except for the policy and the environment."""
        kwargs = self._config.model_kwargs()
        if self._scale is not None and self._config.policy_kwargs.features_extractor_class in (
            None,
            "FlattenExtractor",
        ):
            kwargs["policy_kwargs"] |= {
                "features_extractor_class": ScaledFlattenExtractor,
                "features_extractor_kwargs": {"scale": self._scale},
            }
        return kwargs

    def _seen(self, observation: Observation) -> Observation:
        """Convert the environment's observations to the observations that the policy receives."""
        adapted = self._adapted(observation)
        return adapted if self.normalizer is None else self.normalizer.normalize_obs(adapted)

    def _adapted(self, observation: Observation) -> Observation:
        """Convert the environment's observations as the environment of :meth:`_adapt` does, before normalization."""
        return observation

    def _demonstrate(
        self, source: Callable[[gym.vector.VectorEnv[Any, Any, Any], int], Demonstrations]
    ) -> Demonstrations:
        """Call a function of the environment and a seed, and return its demonstrations with adapted observations."""
        space = self.observation_space
        if any(map(is_image_space, subspaces(space).values())):
            raise IncompatibleSpaceError(
                f"algorithm '{self.name}'",
                space,
                "cannot learn from demonstrations with images; remove the cameras from the observations, or the settings "
                "demonstrations and initial_policy.",
            )
        generators = state.generators()
        try:
            found = source(self.venv.env, self._seed)
        finally:
            # Opening a trained policy seeds the generators and sets the number of threads.
            state.restore_generators(generators)
            self._set_threads(self._config)
        assert found.next_observation is not None
        observation, following = self._adapted(found.observation), self._adapted(found.next_observation)
        return replace(found, observation=observation, next_observation=following)

    def _require_memory(self, setting: str, rows: int, copies: int) -> None:
        """Check that a buffer fits into memory, if the observations contain pictures.

        Args:
            setting: Setting of the algorithm for the number of rows.
            rows: Number of rows.
            copies: Number of observations in each row.
        """
        seen = subspaces(self.observation_space).values()
        if not self.venv.can_step or all(len(part.shape or ()) < 3 for part in seen):
            return
        stored = subspaces(self._env.observation_space).values()
        size = sum(int(np.prod(part.shape or ())) * np.dtype(part.dtype).itemsize for part in stored)
        advice = f"set algorithm_config.{setting} to at most {{count}}"
        require_memory(f"algorithm '{self.name}'", copies * size, rows, "steps", advice)

    def _draws(self) -> state.Arrays:
        """Return the state of all random number generators of the training run."""
        return state.draws(self.model)

    def _restore_draws(self, arrays: state.Arrays) -> None:
        state.restore_draws(self.model, arrays)

    def _write_learning(self, folder: Path) -> None:
        """Write the states of the optimizers, and learned values that are not part of the policy."""
        storage.write_tensors(folder / "optimizers.pt", state.learning(self.model))

    def _read_learning(self, folder: Path) -> None:
        """Load the optimizers, or raise CheckpointError if the file is damaged or does not match the settings."""
        path = folder / "optimizers.pt"
        with storage.matching(path):
            state.restore_learning(self.model, storage.read_tensors(path))

    def _make_model(self, policy: str, **kwargs: Any) -> BaseAlgorithm:
        return self.model_class(policy, self._env, **kwargs)

    def _check_observation_space(self, config: SB3Config) -> None:
        extractor = config.policy_kwargs.features_extractor_class
        check_observation_space(f"algorithm '{self.name}'", self.observation_space, extractor)

    def _check_action_space(self, space: gym.Space[Any]) -> None:
        if isinstance(space, spaces.Box) and not space.is_bounded():
            raise IncompatibleSpaceError(
                f"algorithm '{self.name}'",
                space,
                f"requires actions with finite bounds, but the action space is {space}; "
                "give the action_space of the environment finite bounds, or choose another controller.",
            )
        if isinstance(space, spaces.Discrete | spaces.MultiDiscrete) and np.any(space.start):
            raise IncompatibleSpaceError(
                f"algorithm '{self.name}'",
                space,
                f"requires actions that start at 0, but the action space is {space}; let the action_space of the "
                "environment start at 0.",
            )

    def _restore(self, folder: Path, saved: Mapping[str, Any], continuing: bool) -> None:
        super()._restore(folder, saved, continuing)
        if self.normalizer is not None:
            state.restore_normalizer(self.normalizer, storage.read_arrays(folder / "normalizer.npz"))
            self.normalizer.training = continuing
        state.restore_counters(self.model, saved["counters"])
        if continuing:
            self._read_learning(folder)
            state.restore_last_step(self.model, storage.read_arrays(folder / "last_step.npz"))
            self._pause = state.Pause(self._read_draws(folder / "random.npz"), at_start=bool(saved["at_start"]))
            buffer = getattr(self.model, "replay_buffer", None)
            if buffer is not None:
                replay.read(buffer, folder / "replay")

    def _read_draws(self, path: Path) -> state.Arrays:
        """Return the state of all random number generators, or raise CheckpointError if it cannot be restored."""
        arrays, now = storage.read_arrays(path), self._draws()
        with storage.matching(path):
            self._restore_draws(arrays)
        self._restore_draws(now)
        return arrays

    def _begin(self) -> None:
        """Restore the random state when training starts, after all objects that draw random numbers were built."""
        if self._pause is not None:
            self._restore_draws(self._pause.arrays)
            self._pause = None


@contextmanager
def _named_divergence(name: str) -> Iterator[None]:
    """Convert PyTorch's error about a probability distribution whose parameters are not finite."""
    try:
        yield
    except ValueError as error:
        if "found invalid values" not in str(error):
            raise
        raise NonFiniteValueError(
            f"algorithm '{name}'",
            "has a network that has diverged: its outputs are not finite",
            "train again, for example with a lower learning_rate or with normalized observations and rewards",
        ) from error
