"""The base class for RLlib's algorithms."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import torch as th
from ray.rllib.algorithms.algorithm_config import AlgorithmConfig

from frobs_algos import storage
from frobs_algos.algorithm import PolicyAlgorithm
from frobs_algos.onnx_policy import Joined, PolicyGraph
from frobs_core.contracts import TrainingMonitor
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import ParameterValueError
from frobs_ray.cluster import quiet
from frobs_ray.rllib.config import RLlibConfig
from frobs_ray.rllib.spaces import FlatSpaces
from frobs_ray.rllib.training import Training


class RLlibAlgorithm(PolicyAlgorithm):
    """Base class for RLlib's algorithms. Subclasses define the settings and configure RLlib.

    The networks are stored in this process, so predictions do not require Ray. RLlib's own algorithm object exists only
    during :meth:`train`.

    Attributes:
        module_class: RLlib's module class.
        has_target_networks: Whether the module has copies of networks with earlier weights.
        module: The networks.
        spaces: Converter between the spaces of the environment and the spaces of the networks.
        steps: Number of environment steps taken in training so far.
        learning: State of the optimizers at the end of the last call to :meth:`train`, as arrays by name.
    """

    networks_file: ClassVar[str] = "policy.npz"
    module_class: ClassVar[type[Any]]
    has_target_networks: ClassVar[bool] = False

    module: Any
    spaces: FlatSpaces
    steps: int
    learning: dict[str, np.ndarray[Any, Any]]

    @property
    def settings(self) -> RLlibConfig:
        """The settings."""
        settings: RLlibConfig = self._config
        return settings

    @property
    def seed(self) -> int:
        """The seed of the training run."""
        return self._seed

    @abstractmethod
    def rllib_config(self, steps: int) -> AlgorithmConfig:
        """Return RLlib's configuration of the algorithm, without the configuration of the environments."""

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        env = self._require_env()
        if self.steps < steps:
            th.set_num_threads(self.settings.torch_threads)
            Training(self, env, monitor).run(steps)

    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
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
        super().save(folder, previous)
        storage.write_arrays(folder / "learning.npz", self.learning)

    def model_config(self) -> dict[str, Any]:
        """Return the network settings for RLlib's module."""
        return {**self._config.policy_kwargs.model_dump(), "scale": self._scale}

    def _build(
        self, env: gym.vector.VectorEnv[Any, Any, Any], config: Any, seed: int, scale: list[float] | None
    ) -> None:
        super()._build(env, config, seed, scale)
        runners = config.num_env_runners
        if runners and env.num_envs % runners:
            raise ParameterValueError(
                "num_env_runners", runners, f"a divisor of num_envs = {env.num_envs}", f"algorithm '{self.name}'"
            )
        self.spaces = FlatSpaces(self.observation_space, self.action_space, self.name)
        self._scale = [1.0] * int(self.spaces.observation.shape[0]) if scale is None else scale
        self._sampling = th.Generator().manual_seed(seed)
        self.steps, self.learning = 0, {}
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

    @property
    def _network(self) -> th.nn.Module:
        network: th.nn.Module = self.module
        return network

    def _policy_graph(self) -> PolicyGraph:
        squashed = isinstance(self.action_space, gym.spaces.Box)
        return PolicyGraph(Joined(self.module.mode), self.observation_space, self.action_space, squashed)

    def _progress(self) -> dict[str, Any]:
        return {"steps": self.steps}

    def _restore(self, folder: Path, saved: Mapping[str, Any], continuing: bool) -> None:
        super()._restore(folder, saved, continuing)
        self.steps = int(saved["steps"])
        if continuing:
            self.learning = storage.read_arrays(folder / "learning.npz")
