"""An algorithm: learning."""

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
    """What an algorithm reports while it trains; a run implements it.

    The run watches the environment that it hands over, so an algorithm reports only the episodes of environments that it
    makes and steps itself, for example on other machines: see :meth:`on_episodes`.
    """

    def is_due(self, steps: int) -> bool:
        """Return whether the run wants to be told the progress, or a checkpoint, at so many environment steps.

        Cheap enough to be asked in every step.
        """

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Tell what was learned since the last time; a row of the log.

        Args:
            steps: Environment steps so far, over all environments.
            metrics: The algorithm's own, under its own prefix: ``"ppo/value_loss"``, …

        Returns:
            Whether to go on; where not, ``train`` returns.
        """

    def on_episodes(
        self,
        rewards: Floats,
        lengths: npt.NDArray[np.int64],
        successes: Floats | None = None,
        terms: Mapping[str, Floats] | None = None,
    ) -> None:
        """Report n finished episodes of environments that the algorithm made itself; part of the next row of the log.

        Args:
            rewards: (n,) float64, undiscounted sums.
            lengths: (n,) int64 [control steps].
            successes: (n,) float64, 1.0 or 0.0; None: the environment does not report success.
            terms: Sum of each reward term, (n,) float64, by its name.
        """

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Tell that the algorithm stands where it could continue exactly.

        Args:
            steps: Environment steps so far, over all environments.
            save: :meth:`Algorithm.save`, called if the run wants a checkpoint now.

        Raises:
            CheckpointError: It cannot be written; those before are intact.
        """


class Algorithm(ABC):
    """Base class of algorithms.

    Args:
        env: A vector environment with same-step autoreset, seeded already: reset it without a seed. That of a run has
            the attribute ``recipe``, by which an algorithm makes more environments of the same kind in other processes.
        config: The algorithm's own settings, checked by the algorithm.
        seed: All that the algorithm draws comes from it; in [0, 2³¹).

    Attributes:
        observation_space: Of one environment.
        action_space: Of one environment.

    Raises:
        ConfigurationError: A setting is unknown or out of range, or the spaces are not ones that it can use.
    """

    observation_space: gym.Space[Any]
    action_space: gym.Space[Any]

    @abstractmethod
    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None: ...

    @classmethod
    @abstractmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        """Check settings and fill in the defaults, as values that YAML can hold; what is resolved stays as it is.

        :func:`frobs_core.validation.validate` does it with a pydantic model, and names file and line.

        Raises:
            UnknownParameterError: A key is unknown; the nearest is named.
            ConfigurationError: A value is out of range or of the wrong type; the key and the bounds are named.
        """

    @abstractmethod
    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Learn until ``steps`` environment steps were taken, over all environments, those before a load included."""

    @abstractmethod
    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations, and the state of a recurrent policy.

        A prediction, drawn or not, changes neither what was learned nor the generators of the training.
        """

    @abstractmethod
    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Write everything that :meth:`load` needs into an empty folder.

        Args:
            folder: The folder.
            previous: What this training wrote last, complete and on the same disk: a file that has not changed since
                may be a hard link to the one there, so that a checkpoint costs what is new. None: nothing was.

        Raises:
            OSError: The disk is full, or the folder cannot be written.
        """

    def save_policy(self, folder: Path) -> None:
        """Write what :meth:`load` needs to predict, without an environment, into an empty folder.

        Everything, where an algorithm does not say otherwise; leave out what only training needs.

        Raises:
            OSError: The disk is full, or the folder cannot be written.
        """
        self.save(folder)

    def forget_episodes(self) -> None:
        """Forget what was loaded of episodes under way: the environment could not be restored, and was reset.

        Called between :meth:`load` and :meth:`train`, where a run is continued on an environment without a snapshot.
        """

    def timed_parts(self) -> Mapping[str, Sequence[tuple[object, str]]]:
        """Return the methods that ``frobs bench ID --training`` times, for each part of a training run.

        Optional. Use these names for the parts: ``"inference"`` chooses actions and estimates values while experience is
        collected, ``"updates"`` performs gradient steps, and ``"storage"`` maintains the rollout or replay buffer. Each
        method is replaced by one that measures its time, as an attribute of its owner, so :meth:`train` must look it up
        there at each call. If a timed method calls another one, the time of the inner call counts for its own part only.

        Returns:
            For each part its methods, as pairs of owner and method name. Empty by default: only the time of the
            environments is then known.
        """
        return {}

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

    @classmethod
    def load_with(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any]) -> Self:
        """Read what :meth:`save` wrote, and continue with other settings. Population-based training needs it.

        Optional. An algorithm that supports it can continue with another learning rate, discount, batch size and the like.

        Args:
            folder: The folder.
            env: The environment.
            config: The new settings, complete.

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
        """Return the deterministic policy as an ONNX graph, from the raw observation to the action that is taken.

        Whatever scales, normalises, squashes or clips is in the graph. An algorithm may leave this out.

        The first axis of every input and output is the batch, of any size. Inputs: ``"observation"`` as the space says
        it, or ``"observation/<key>"`` for each key of a Dict; of a recurrent policy also ``"state/0"``, ``"state/1"``,
        …, float, zeros at first, and ``"episode_start"``, (batch,) bool. Outputs: ``"action"`` in the action space;
        where it is discrete ``"scores"``, (batch, choices) float, of which the greatest is chosen; and
        ``"next_state/0"``, … for each state.

        Raises:
            ConfigurationError: The algorithm cannot be exported, or what the export needs is not installed.
        """
        raise PolicyExportError(f"the algorithm {type(self).__name__}", "it has no export_onnx.")
