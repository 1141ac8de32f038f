"""The base class for RLlib's algorithms."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import gymnasium as gym
import numpy as np
import torch as th
from ray.rllib.algorithms.algorithm_config import AlgorithmConfig

from frobs_algos import storage
from frobs_algos.spaces import space_from_json, space_to_json, suggested_scale
from frobs_core.contracts import Algorithm, TrainingMonitor
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import CheckpointError, ModelMismatchError, ParameterValueError, RunError
from frobs_core.util.validation import validate
from frobs_ray.cluster import quiet
from frobs_ray.rllib import state
from frobs_ray.rllib.config import RLlibConfig
from frobs_ray.rllib.spaces import FlatSpaces
from frobs_ray.rllib.training import Training

FORMAT = 1
"""Version of the file format that :meth:`RLlibAlgorithm.save` writes."""


class RLlibAlgorithm(Algorithm):
    """Base class for RLlib's algorithms. Subclasses define the settings and configure RLlib.

    The networks are stored in this process, so predictions do not require Ray. RLlib's own algorithm object exists only
    during :meth:`train`.

    Attributes:
        name: Name in the algorithm's record.
        config_model: Pydantic model of the accepted settings.
        module_class: RLlib's module class.
        module: The networks.
        spaces: Converter between the spaces of the environment and the spaces of the networks.
        env: The environment, or None if the algorithm can only predict.
        steps: Number of environment steps taken in training so far.
        learning: State of the optimizers at the end of the last call to :meth:`train`.
    """

    name: ClassVar[str]
    config_model: ClassVar[type[RLlibConfig]]
    module_class: ClassVar[type[Any]]

    module: Any
    spaces: FlatSpaces
    env: gym.vector.VectorEnv[Any, Any, Any] | None
    steps: int
    learning: state.Arrays

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None:
        settings = self._settings(config)
        suggested = suggested_scale(env) if settings.scale_observation else None
        self._build(env.single_observation_space, env.single_action_space, env.num_envs, settings, seed, suggested)
        self._attach(env)

    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        """Validate settings and add default values."""
        return cls._settings(config).model_dump(mode="json")

    @property
    def settings(self) -> RLlibConfig:
        """The settings."""
        return self._config

    @property
    def seed(self) -> int:
        """The seed of the training run."""
        return self._seed

    @abstractmethod
    def rllib_config(self, steps: int) -> AlgorithmConfig:
        """Return RLlib's configuration of the algorithm, without the configuration of the environments.

        Args:
            steps: Number of environment steps at the end of training.
        """

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Train until ``steps`` environment steps have been taken."""
        if self.env is None:
            raise RunError("this algorithm was loaded for prediction only; load it with an environment to train it.")
        if self.steps >= steps:
            return
        th.set_num_threads(self._config.torch_threads)
        Training(self, self.env, monitor).run(steps)

    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations."""
        inputs = th.from_numpy(self.spaces.flatten(observation))
        with th.no_grad():
            if not deterministic:
                chosen = self.module.act(inputs, self._sampling)["actions"]
            elif isinstance(self.action_space, gym.spaces.Discrete):
                chosen = self.module.mode(inputs).argmax(dim=-1)
            else:
                chosen = self.module.mode(inputs)
        return self.spaces.to_env(chosen.numpy()), None

    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Write the networks, the optimizer states and the step counter. SAC's replay buffer is not saved."""
        self.save_policy(folder)
        storage.write_arrays(folder / "learning.npz", self.learning)

    def save_policy(self, folder: Path) -> None:
        """Write only the policy, which consists of ``algorithm.json`` and the networks."""
        storage.write_json(
            folder / "algorithm.json",
            {
                "format": FORMAT,
                "algorithm": self.name,
                "config": self._config.model_dump(mode="json"),
                "seed": self._seed,
                "observation_scale": self._scale,
                "num_envs": self._num_envs,
                "observation_space": space_to_json(self.observation_space),
                "action_space": space_to_json(self.action_space),
                "steps": self.steps,
            },
        )
        weights = state.weights(self.module)
        storage.check_networks(f"algorithm '{self.name}'", weights)
        storage.write_arrays(folder / "policy.npz", weights)

    @classmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        """Load an algorithm written by :meth:`save`. If ``env`` is given, training can continue with new episodes."""
        saved = storage.read_saved(folder, cls.name, FORMAT)
        algorithm = cls.__new__(cls)
        try:
            algorithm._build(
                space_from_json(saved["observation_space"]),
                space_from_json(saved["action_space"]),
                saved["num_envs"],
                cls._settings(saved["config"]),
                saved["seed"],
                saved["observation_scale"],
            )
            algorithm.steps = int(saved["steps"])
        except KeyError as error:
            raise CheckpointError(f"{folder} is incomplete: {error} is missing.") from error
        weights = storage.read_arrays(folder / "policy.npz")
        storage.check_networks(folder / "policy.npz", weights)
        state.restore_weights(algorithm.module, weights)
        if env is not None:
            algorithm.learning = storage.read_arrays(folder / "learning.npz")
            algorithm._check_same(env)
            algorithm._attach(env)
        return algorithm

    def export_onnx(self) -> bytes:
        """Return the deterministic policy as an ONNX graph."""
        from frobs_algos.onnx import export_graph  # imported late, because importing the tracer is slow
        from frobs_ray.rllib.onnx import policy_graph

        return export_graph(lambda: policy_graph(self.module, self.observation_space, self.action_space))

    @classmethod
    def _settings(cls, config: Mapping[str, Any]) -> RLlibConfig:
        return validate(cls.config_model, config, f"algorithm '{cls.name}'")

    def _build(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        num_envs: int,
        config: RLlibConfig,
        seed: int,
        scale: list[float] | None,
    ) -> None:
        self._config, self._seed, self._num_envs = config, seed, num_envs
        self.observation_space, self.action_space = observation_space, action_space
        self.spaces = FlatSpaces(observation_space, action_space, self.name)
        self._scale = [1.0] * int(self.spaces.observation.shape[0]) if scale is None else scale
        self._sampling = th.Generator().manual_seed(seed)
        self.env, self.steps, self.learning = None, 0, {}
        with th.random.fork_rng(devices=[]), quiet():
            th.manual_seed(seed)
            self.module = self.module_class(
                observation_space=self.spaces.observation,
                action_space=self.spaces.action,
                inference_only=False,
                model_config=self.model_config(),
            )
            if self.has_target_networks:
                self.module.make_target_networks()

    has_target_networks: ClassVar[bool] = False

    def model_config(self) -> dict[str, Any]:
        """Return the network settings for RLlib's module."""
        config: Any = self._config
        return {**config.policy_kwargs.model_dump(), "scale": self._scale}

    def _attach(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        runners = self._config.num_env_runners
        if runners and env.num_envs % runners:
            raise ParameterValueError(
                "num_env_runners", runners, f"a divisor of num_envs = {env.num_envs}", f"algorithm '{self.name}'"
            )
        self.env = env

    def _check_same(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        for what, saved, current in (
            ("num_envs", self._num_envs, env.num_envs),
            ("observation_space", self.observation_space, env.single_observation_space),
            ("action_space", self.action_space, env.single_action_space),
        ):
            if saved != current:
                raise ModelMismatchError("the training run", what, saved, current)
