"""The base classes for sbx's algorithms, which implement stable-baselines3's algorithms in JAX."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from frobs_algos import storage
from frobs_algos_sb3 import state as sb3_state
from frobs_algos_sb3.algorithm import SB3Algorithm
from frobs_algos_sb3.config import SB3Config
from frobs_algos_sb3.off_policy import GOAL_KEYS, OffPolicy
from frobs_algos_sbx import state
from frobs_algos_sbx.observations import FlatObservations
from frobs_algos_sbx.threads import set_threads
from frobs_core.description import Observation


class JaxAlgorithm(SB3Algorithm):
    """Base class for sbx's algorithms."""

    _flat: FlatObservations | None

    def _adapt(self, venv: VecEnv) -> VecEnv:
        self._flat = None if self._keeps_dict() else FlatObservations(venv, self._scale)
        return venv if self._flat is None else self._flat

    def _set_threads(self, config: SB3Config) -> None:
        super()._set_threads(config)  # also limits PyTorch's threads, because stable-baselines3's buffers use PyTorch
        set_threads(config.torch_threads)

    def _keeps_dict(self) -> bool:
        """Return whether the policy receives observations unchanged, as a dictionary of flat arrays."""
        return False

    def _policy(self) -> str:
        return "MultiInputPolicy" if self._flat is None else "MlpPolicy"

    def _model_kwargs(self) -> dict[str, Any]:
        return self._config.model_kwargs()

    def _check_observation_space(self, config: SB3Config) -> None:
        """Do nothing, because :func:`~frobs_algos_sbx.observations.flat_space` checks the space."""

    def _adapted(self, observation: Observation) -> Observation:
        return observation if self._flat is None else self._flat.flatten(observation)

    def _draws(self) -> sb3_state.Arrays:
        return super()._draws() | state.keys(self.model)

    def _restore_draws(self, arrays: sb3_state.Arrays) -> None:
        super()._restore_draws(arrays)
        state.restore_keys(self.model, arrays)

    def _write_networks(self, folder: Path) -> None:
        storage.write_networks(folder / "policy.npz", f"algorithm '{self.name}'", state.networks(self.model))

    def _read_networks(self, folder: Path) -> None:
        self._read(folder / "policy.npz", state.networks)
        storage.check_networks(folder / "policy.npz", state.networks(self.model))

    def _write_learning(self, folder: Path) -> None:
        storage.write_arrays(folder / "optimizers.npz", state.learning(self.model))

    def _read_learning(self, folder: Path) -> None:
        self._read(folder / "optimizers.npz", state.learning)

    def _read(self, path: Path, part: Callable[[BaseAlgorithm], Mapping[str, np.ndarray[Any, Any]]]) -> None:
        arrays = storage.read_arrays(path)
        with storage.matching(path):
            if set(arrays) != set(part(self.model)):
                raise ValueError("the arrays in the file have different names than the model's arrays")
            state.restore(self.model, arrays)

    def _policy_graph(self) -> Any:
        from frobs_algos_sbx.onnx import policy_graph

        activation = self._config.policy_kwargs.activation_fn
        return policy_graph(self.model, self.normalizer, self._flat, self.observation_space, activation)


class JaxOffPolicy(JaxAlgorithm, OffPolicy):
    """Base class for sbx's off-policy algorithms."""

    def _make_model(self, policy: str, **kwargs: Any) -> OffPolicyAlgorithm:
        model = super()._make_model(policy, **kwargs)
        state.restore(model, state.initial_networks(model, self._seed))
        return model

    def _keeps_dict(self) -> bool:
        space = self.observation_space
        return isinstance(space, spaces.Dict) and set(space.spaces) >= GOAL_KEYS
