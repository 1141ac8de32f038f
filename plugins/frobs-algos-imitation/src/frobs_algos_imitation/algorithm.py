"""The base class of all algorithms: settings, files, prediction, export, and updates of the network."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import gymnasium as gym
import numpy as np
import torch as th

from frobs_algos import storage
from frobs_algos.spaces import space_from_json, space_to_json
from frobs_algos_imitation.config import ImitationConfig
from frobs_algos_imitation.networks import Perceptron
from frobs_algos_imitation.policy import ImitationPolicy
from frobs_algos_imitation.samples import Samples, in_order
from frobs_core.contracts import Algorithm
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import (
    CheckpointError,
    IncompatibleSpaceError,
    ModelMismatchError,
    NonFiniteValueError,
    RunError,
)
from frobs_core.util.validation import validate

FORMAT = 1
"""Version of the file format that :meth:`ImitationAlgorithm.save` writes."""


class ImitationAlgorithm(Algorithm):
    """Base class of algorithms that fit a network to actions.

    Attributes:
        name: Name in the algorithm's record.
        config_model: Pydantic model of the accepted settings.
        policy: The policy.
        steps: Number of training steps so far.
        samples: Samples collected so far, or None.
    """

    name: ClassVar[str]
    config_model: ClassVar[type[ImitationConfig]]

    policy: ImitationPolicy
    steps: int
    samples: Samples | None

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None:
        self._build(env, env.single_observation_space, env.single_action_space, self._settings(config), seed)

    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        """Return validated settings with all defaults added."""
        settings: dict[str, Any] = cls._settings(config).model_dump(mode="json")
        return settings

    @classmethod
    def _settings(cls, config: Mapping[str, Any]) -> Any:
        return validate(cls.config_model, config, f"algorithm '{cls.name}'")

    def _build(
        self,
        env: gym.vector.VectorEnv[Any, Any, Any] | None,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        config: Any,
        seed: int,
    ) -> None:
        self._check_spaces(observation_space, action_space)
        self.observation_space, self.action_space = observation_space, action_space
        self._env, self._config, self._seed = env, config, seed
        self.steps, self.samples = 0, None
        th.set_num_threads(config.torch_threads)
        self._generator = th.Generator().manual_seed(seed)
        with th.random.fork_rng(devices=[]):
            th.manual_seed(seed)
            self.policy = self._make_policy()
        self._begin_fit()

    def _make_policy(self) -> ImitationPolicy:
        space: Any = self.action_space
        return ImitationPolicy(self.observation_space, space, self._make_network, self._config.history)

    def _make_network(self, frame: int, action: int) -> th.nn.Module:
        return Perceptron(self._config.history, frame, action, self._config.net_arch)

    def _check_spaces(self, observation: gym.Space[Any], action: gym.Space[Any]) -> None:
        owner = f"algorithm '{self.name}'"
        parts = observation.spaces.values() if isinstance(observation, gym.spaces.Dict) else [observation]
        if not all(isinstance(part, gym.spaces.Box) and len(part.shape) == 1 for part in parts):
            raise IncompatibleSpaceError(
                owner, observation, f"learns only from vectors, but the observation space is {observation}; leave "
                "out the cameras."
            )  # fmt: skip
        if not isinstance(action, gym.spaces.Box) or not action.is_bounded():
            raise IncompatibleSpaceError(
                owner, action, f"requires actions with finite bounds, but the action space is {action}; choose another "
                "controller."
            )  # fmt: skip

    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations, and the next state. The policy is always deterministic."""
        ordered = in_order(observation, self.observation_space)
        parts = [*ordered.values()] if isinstance(ordered, dict) else [ordered]
        inputs, n = [th.as_tensor(np.ascontiguousarray(part)) for part in parts], len(parts[0])
        if shapes := self.policy.state_shapes:
            given = [np.zeros((n, *shape), np.float32) for shape in shapes] if state is None else state
            inputs += [th.as_tensor(part) for part in given]
            start = np.full(n, state is None) if episode_start is None else episode_start
            inputs.append(th.as_tensor(np.ascontiguousarray(start, np.bool_)))
        with th.no_grad():
            action, *following = (part.numpy() for part in self.policy(*inputs))
        return action.astype(self.action_space.dtype, copy=False), tuple(following) or None

    def export_onnx(self) -> bytes:
        """Return the policy as an ONNX graph."""
        from frobs_algos.onnx import export_graph  # imported here because importing the tracer is slow

        return export_graph(lambda: self.policy)

    def _training_env(self) -> gym.vector.VectorEnv[Any, Any, Any]:
        if self._env is None:
            raise RunError("this algorithm was loaded for prediction only; load it with an environment to train it.")
        return self._env

    @property
    @abstractmethod
    def _chunk(self) -> int:
        """Number of actions that the network predicts."""

    def _begin_fit(self) -> None:
        """Start with a new optimizer."""
        self._optimizer = th.optim.AdamW(
            self.policy.parameters(), self._config.learning_rate, weight_decay=self._config.weight_decay
        )

    def _update(self, progress: float) -> float:
        """Update the network once, and return the loss.

        Args:
            progress: Share of the updates that are done, in [0, 1).
        """
        assert self.samples is not None
        config, samples = self._config, self.samples
        indices = th.randint(len(samples), (config.batch_size,), generator=self._generator)
        windows, labels, valid = samples.batch(indices, config.history, self._chunk)
        for group in self._optimizer.param_groups:
            group["lr"] = 0.5 * config.learning_rate * (1.0 + math.cos(math.pi * progress))
        error = (self.policy.predictions(windows) - self.policy.scaled(labels)).abs().mean(-1)
        loss = (error * valid).sum() / valid.sum()
        self._optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self._optimizer.step()
        value = float(loss.detach())
        if not math.isfinite(value):
            raise NonFiniteValueError(
                f"algorithm '{self.name}'", "has a loss that is not finite", "train again with a lower learning_rate"
            )
        return value

    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Save the policy, the samples, the optimizer and the random state."""
        self.save_policy(folder)
        storage.write_tensors(
            folder / "training.pt",
            {"optimizer": self._optimizer.state_dict(), "generator": self._generator.get_state()},
        )
        if self.samples is not None:
            self.samples.write(folder / "samples", None if previous is None else previous / "samples")

    def save_policy(self, folder: Path) -> None:
        """Save only the policy: ``algorithm.json`` and the network."""
        content = {
            "format": FORMAT,
            "algorithm": self.name,
            "config": self._config.model_dump(mode="json"),
            "seed": self._seed,
            "steps": self.steps,
            "observation_space": space_to_json(self.observation_space),
            "action_space": space_to_json(self.action_space),
        }
        storage.write_json(folder / "algorithm.json", content)
        weights = self.policy.state_dict()
        storage.check_networks(f"algorithm '{self.name}'", weights)
        storage.write_tensors(folder / "policy.pt", weights)

    @classmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        """Load an algorithm from a folder that :meth:`save` wrote. If ``env`` is given, training can continue."""
        saved = storage.read_saved(folder, cls.name, FORMAT)
        algorithm = cls.__new__(cls)
        try:
            spaces = space_from_json(saved["observation_space"]), space_from_json(saved["action_space"])
            if env is not None:
                _check_same(spaces, (env.single_observation_space, env.single_action_space))
            algorithm._build(env, *spaces, cls._settings(saved["config"]), int(saved["seed"]))
            algorithm.steps = int(saved["steps"])
            weights = storage.read_tensors(folder / "policy.pt")
            storage.check_networks(folder / "policy.pt", weights)
            algorithm.policy.load_state_dict(weights)
            if env is not None:
                algorithm._restore_training(folder)
        except (KeyError, TypeError, ValueError, RuntimeError) as error:
            raise CheckpointError(f"{folder} is damaged: {type(error).__name__}: {error}.") from error
        return algorithm

    def _restore_training(self, folder: Path) -> None:
        saved = storage.read_tensors(folder / "training.pt")
        self._optimizer.load_state_dict(saved["optimizer"])
        self._generator.set_state(saved["generator"])
        if (folder / "samples").is_dir():
            self.samples = Samples.read(folder / "samples")


def _check_same(saved: tuple[gym.Space[Any], gym.Space[Any]], given: tuple[gym.Space[Any], gym.Space[Any]]) -> None:
    for what, old, new in zip(("observation_space", "action_space"), saved, given, strict=True):
        if old != new:
            raise ModelMismatchError("the training run", what, old, new)
