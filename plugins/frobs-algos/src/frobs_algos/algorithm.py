"""The base class of algorithms that learn the networks of a policy: settings, files, spaces and export."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import gymnasium as gym
import torch as th

from frobs_algos import storage
from frobs_algos.settings import Settings
from frobs_algos.spaces import NoEnvironment, space_from_json, space_to_json, suggested_scale
from frobs_core.contracts import Algorithm
from frobs_core.util.errors import CheckpointError, ModelMismatchError, RunError
from frobs_core.util.validation import validate

if TYPE_CHECKING:
    from frobs_algos.onnx import TraceablePolicy

__all__ = ["PolicyAlgorithm"]


class PolicyAlgorithm(Algorithm):
    """Base class of algorithms that learn the networks of a policy.

    A subclass sets the class attributes, extends :meth:`_build` to make its networks, extends :meth:`save` and
    :meth:`_restore` by the state of training, and implements ``train``, ``predict``, :attr:`_network` and
    :meth:`_policy_graph`.

    Attributes:
        name: Name in the algorithm's record.
        config_model: Pydantic model of the accepted settings.
        format: Version of the file format that :meth:`save` writes.
        networks_file: Name of the file with the networks.
        env: Environment of the training run, or a :class:`~frobs_algos.spaces.NoEnvironment` if the algorithm was loaded
            for prediction only.
    """

    name: ClassVar[str]
    config_model: ClassVar[type[Settings]]
    format: ClassVar[int] = 1
    networks_file: ClassVar[str] = "policy.pt"

    env: gym.vector.VectorEnv[Any, Any, Any]

    def __init__(
        self, env: gym.vector.VectorEnv[Any, Any, Any], config: Settings | Mapping[str, Any], seed: int
    ) -> None:
        settings = self.resolve_config(config)
        self._build(env, settings, seed, suggested_scale(env) if settings.scales_observation else None)

    @classmethod
    def resolve_config(cls, config: Any) -> Any:
        """Return validated settings, an instance of ``config_model``. Such an instance is returned unchanged."""
        return validate(cls.config_model, config, f"algorithm '{cls.name}'")

    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Save the policy. Subclasses add the data that is needed to continue training."""
        self.save_policy(folder)

    def save_policy(self, folder: Path) -> None:
        """Save only the policy: ``algorithm.json`` and the networks."""
        content = {
            "format": self.format,
            "algorithm": self.name,
            "config": self._config.model_dump(mode="json"),
            "seed": self._seed,
            "observation_scale": self._scale,
            "num_envs": self.env.num_envs,
            "observation_space": space_to_json(self.observation_space),
            "action_space": space_to_json(self.action_space),
        }
        storage.write_json(folder / "algorithm.json", content | self._progress())
        self._write_networks(folder)

    @classmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        return cls._load(folder, env)

    @classmethod
    def _load(
        cls,
        folder: Path,
        env: gym.vector.VectorEnv[Any, Any, Any] | None,
        config: Settings | Mapping[str, Any] | None = None,
    ) -> Self:
        """Load an algorithm, with other settings if ``config`` is given."""
        saved = storage.read_saved(folder, cls.name, cls.format)
        algorithm = cls.__new__(cls)
        try:
            settings = cls.resolve_config(saved["config"])
            if config is not None:
                settings = cls._changed(settings, cls.resolve_config(config))
            spaces = NoEnvironment(
                saved["num_envs"], space_from_json(saved["observation_space"]), space_from_json(saved["action_space"])
            )
            if env is not None:
                _check_same(spaces, env)
            algorithm._build(spaces if env is None else env, settings, int(saved["seed"]), saved["observation_scale"])
            algorithm._restore(folder, saved, continuing=env is not None)
        except KeyError as error:
            raise CheckpointError(f"{folder} is incomplete: {error} is missing.") from error
        return algorithm

    @classmethod
    def _changed(cls, before: Any, after: Any) -> Any:
        """Return the new settings, or raise ConfigurationError if they do not fit the saved networks and buffers."""
        return after

    def export_onnx(self) -> bytes:
        from frobs_algos.onnx import export_graph  # imported here because importing the tracer is slow

        return export_graph(self._policy_graph)

    def _build(
        self, env: gym.vector.VectorEnv[Any, Any, Any], config: Any, seed: int, scale: list[float] | None
    ) -> None:
        """Store the arguments. Subclasses check the spaces and make the networks."""
        self.env, self._config, self._seed, self._scale = env, config, seed, scale
        self.observation_space, self.action_space = env.single_observation_space, env.single_action_space

    @property
    @abstractmethod
    def _network(self) -> th.nn.Module:
        """The networks of the policy."""

    @abstractmethod
    def _policy_graph(self) -> TraceablePolicy:
        """Return the deterministic policy as a module for the export."""

    @abstractmethod
    def _progress(self) -> dict[str, Any]:
        """Return numbers about the training run that ``algorithm.json`` contains."""

    def _restore(self, folder: Path, saved: Mapping[str, Any], continuing: bool) -> None:
        """Restore the networks, given ``algorithm.json``, and all other state if training continues."""
        self._read_networks(folder)

    def _write_networks(self, folder: Path) -> None:
        storage.write_networks(folder / self.networks_file, f"algorithm '{self.name}'", self._network.state_dict())

    def _read_networks(self, folder: Path) -> None:
        """Load the weights, or raise CheckpointError if the file is damaged or does not match the settings."""
        path = folder / self.networks_file
        weights = storage.read_networks(path)
        with storage.matching(path):
            self._network.load_state_dict(weights)

    def _require_env(self) -> gym.vector.VectorEnv[Any, Any, Any]:
        """Return the environment of the training run, or raise RunError if there is none."""
        if isinstance(self.env, NoEnvironment):
            raise RunError("this algorithm was loaded for prediction only; load it with an environment to train it.")
        return self.env


def _check_same(saved: gym.vector.VectorEnv[Any, Any, Any], env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
    for name in ("num_envs", "single_observation_space", "single_action_space"):
        before, now = getattr(saved, name), getattr(env, name)
        if before != now:
            raise ModelMismatchError("the training run", name.removeprefix("single_"), before, now)
