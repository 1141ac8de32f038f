"""An algorithm: learning."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, Self

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action, Mask
from frobs_core.interfaces.task import Observation


class TrainingMonitor(Protocol):
    """What an algorithm tells while it trains; a run implements it."""

    def on_episode(self, reward: float, length: int, success: float | None, terms: Mapping[str, float]) -> None:
        """Tell that an episode ended.

        Args:
            reward: Undiscounted sum.
            length: [control steps]
            success: 1.0 or 0.0 at its end; None where the environment does not say.
            terms: Sum of each reward term over the episode.
        """

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Tell that an iteration ended.

        Args:
            steps: Environment steps so far, over all environments.
            metrics: The algorithm's own: losses, learning rate, …

        Returns:
            Whether to go on.
        """

    def checkpoint_due(self, steps: int) -> bool:
        """Return whether a checkpoint should be written now."""

    def checkpoint_folder(self, steps: int) -> Path:
        """Return an empty folder to write the checkpoint to; it counts once :meth:`checkpoint_done` is called."""

    def checkpoint_done(self, steps: int) -> None:
        """Tell that the checkpoint is complete."""


class Algorithm(ABC):
    """Base class of algorithms.

    Args:
        env: A vector environment with same-step autoreset.
        config: The algorithm's own settings, checked by the algorithm.
        seed: All that the algorithm draws comes from it.

    Raises:
        ConfigurationError: A setting is unknown or out of range, or the spaces are not ones that it can use.
    """

    @abstractmethod
    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None: ...

    @classmethod
    @abstractmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        """Check settings and fill in the defaults.

        Raises:
            UnknownParameterError: A key is unknown; the nearest is named.
            ConfigurationError: A value is out of range or of the wrong type; the key and the bounds are named.
        """

    @abstractmethod
    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Learn for ``steps`` environment steps, over all environments together."""

    @abstractmethod
    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations, and the state of a recurrent policy."""

    @abstractmethod
    def save(self, folder: Path) -> None:
        """Write everything that :meth:`load` needs into an empty folder."""

    @classmethod
    @abstractmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        """Read what :meth:`save` wrote, executing nothing that the files hold.

        Args:
            folder: The folder.
            env: None: for prediction only.

        Raises:
            CheckpointError: A file is missing or damaged.
            UntrustedFileError: A file could only be opened by executing it.
        """
