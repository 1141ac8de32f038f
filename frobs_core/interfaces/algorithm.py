"""The interface of learning algorithms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, Self

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Action, Floats, Mask
from frobs_core.errors import ConfigurationError, PolicyExportError
from frobs_core.observation import Observation


class TrainingMonitor(Protocol):
    """Interface through which an algorithm reports to its run during training.

    The run observes the environment that it passes to the algorithm. An algorithm therefore reports only the episodes
    of environments that it creates and steps itself, for example on other machines; see :meth:`on_episodes`.
    """

    def is_due(self, steps: int) -> bool:
        """Return whether a progress report or a checkpoint is due at this number of environment steps.

        This is cheap enough to call in every step.
        """

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Log the training metrics since the last call as one row.

        Args:
            steps: Environment steps so far, over all environments.
            metrics: The algorithm's metrics, named with its own prefix: ``"ppo/value_loss"``, …

        Returns:
            Whether to continue. If False, ``train`` returns.
        """

    def on_episodes(
        self,
        rewards: Floats,
        lengths: npt.NDArray[np.int64],
        successes: Floats | None = None,
        terms: Mapping[str, Floats] | None = None,
    ) -> None:
        """Report n finished episodes of environments that the algorithm created itself, for the next log row.

        Args:
            rewards: (n,) float64, undiscounted sums.
            lengths: (n,) int64 [control steps].
            successes: (n,) float64, 1.0 or 0.0, or None if the environment does not report success.
            terms: Sum of each reward term by name, (n,) float64.
        """

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Offer a checkpoint at a point from which training could continue exactly.

        Args:
            steps: Environment steps so far, over all environments.
            save: :meth:`Algorithm.save`, which is called if the run needs a checkpoint now.

        Raises:
            CheckpointError: The checkpoint cannot be written. Earlier checkpoints remain intact.
        """


class Algorithm(ABC):
    """Base class of algorithms.

    Args:
        env: A vector environment with same-step autoreset. It is already seeded, so reset it without a seed. A run's
            environment has the attribute ``recipe``, from which an algorithm can create more such environments in other
            processes.
        config: The algorithm's settings, validated by the algorithm.
        seed: Seed for all random numbers that the algorithm draws, in [0, 2³¹).

    Attributes:
        observation_space: Observation space of a single environment.
        action_space: Action space of a single environment.

    Raises:
        ConfigurationError: A setting is unknown or out of range, or the algorithm does not support the spaces.
    """

    observation_space: gym.Space[Any]
    action_space: gym.Space[Any]

    @abstractmethod
    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None: ...

    @classmethod
    @abstractmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        """Validate settings and add the defaults, as YAML-serializable values. Resolved settings do not change.

        :func:`frobs_core.validation.validate` does this with a pydantic model and reports the file and line of an
        error.

        Raises:
            UnknownParameterError: A key is unknown; the message suggests the nearest one.
            ConfigurationError: A value is out of range or of the wrong type; the message contains the key and its
                bounds.
        """

    @abstractmethod
    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Train until ``steps`` environment steps have been taken in total, including those before a load."""

    @abstractmethod
    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations, and the next state of a recurrent policy.

        Predictions, deterministic or random, affect neither the learned parameters nor the random generators used in
        training.
        """

    @abstractmethod
    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Write everything that :meth:`load` needs to an empty folder.

        Args:
            folder: The empty folder.
            previous: Latest checkpoint of this training run, complete and on the same disk, or None. Files that have
                not changed since then may be hard links to it, so that a checkpoint takes space only for new data.

        Raises:
            OSError: The disk is full, or the folder cannot be written.
        """

    def save_policy(self, folder: Path) -> None:
        """Write everything that :meth:`load` needs for prediction without an environment to an empty folder.

        By default this saves everything. Override it to omit data that only training needs.

        Raises:
            OSError: The disk is full, or the folder cannot be written.
        """
        self.save(folder)

    def forget_episodes(self) -> None:
        """Discard loaded data about unfinished episodes, because the environment was reset instead of restored.

        Called between :meth:`load` and :meth:`train` when a run is resumed on an environment that does not support
        snapshots.
        """

    def timed_parts(self) -> Mapping[str, Sequence[tuple[object, str]]]:
        """Return the methods that ``frobs bench ID --training`` times, for each part of a training run.

        Optional. Name the parts as follows: ``"inference"`` chooses actions and estimates values while experience is
        collected, ``"updates"`` performs gradient steps, and ``"storage"`` maintains the rollout or replay buffer. Each
        method is replaced, as an attribute of its owner, by one that measures its time, so :meth:`train` must look it
        up there at each call. If one timed method calls another, the inner call's time counts only toward its own part.

        Returns:
            The methods of each part, as pairs of owner and method name. The default is empty, in which case only the
            environments' time is known.
        """
        return {}

    @classmethod
    @abstractmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        """Read the files written by :meth:`save`, without executing any code from them.

        Args:
            folder: The folder.
            env: Environment in which to continue training, or None to load for prediction only.

        Raises:
            CheckpointError: A file is missing or damaged.
            UntrustedFileError: A file can be read only by executing code in it.
        """

    @classmethod
    def load_with(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any]) -> Self:
        """Read the files written by :meth:`save` and continue with other settings. Used by population-based training.

        Optional. An algorithm that supports it can continue with a different learning rate, discount, batch size and so
        on.

        Args:
            folder: The folder.
            env: The environment.
            config: The complete new settings.

        Raises:
            ConfigurationError: A setting cannot change, because the networks or buffers depend on it, or the algorithm
                does not support changes.
            CheckpointError: A file is missing or damaged.
        """
        raise ConfigurationError(
            f"the algorithm {cls.__name__} cannot change its settings during training, because it has no load_with; "
            "search with another --pruner."
        )

    def export_onnx(self) -> bytes:
        """Return the deterministic policy as an ONNX graph from the raw observation to the executed action.

        Optional. The graph includes all scaling, normalization, squashing and clipping.

        The first axis of every input and output is the batch, of any size. Inputs: ``"observation"`` as in the
        observation space, or ``"observation/<key>"`` for each key of a Dict. Recurrent policies also have
        ``"state/0"``, ``"state/1"``, …, float, initially zero, and ``"episode_start"``, (batch,) bool. Outputs:
        ``"action"`` in the action space; for discrete actions, ``"scores"``, (batch, choices) float, of which the
        largest is chosen; and ``"next_state/0"``, … for each state.

        Raises:
            ConfigurationError: The algorithm cannot be exported, or a package that the export needs is not installed.
        """
        raise PolicyExportError(f"the algorithm {type(self).__name__}", "it has no export_onnx.")
