"""The interface for learning algorithms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Floats, Mask
from frobs_core.util.errors import ConfigurationError, PolicyExportError

if TYPE_CHECKING:
    from pydantic import BaseModel


class TrainingMonitor(Protocol):
    """Interface through which an algorithm reports to its run during training.

    The run itself records the episodes of the environment that it passes to the algorithm. An algorithm therefore
    reports only the episodes of environments that it creates and steps itself, for example on other machines (see
    :meth:`on_episodes`).
    """

    def is_due(self, steps: int) -> bool:
        """Return whether a progress report or a checkpoint is due at this number of environment steps.

        This method is cheap enough to be called at every step.
        """

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Log the training metrics collected since the last call as one row.

        Args:
            steps: Number of environment steps so far, summed over all environments.
            metrics: Metrics by name, with a prefix that identifies the algorithm, such as ``"ppo/value_loss"``.

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
        """Add n finished episodes to the next log row. The algorithm must have created their environments itself.

        Args:
            rewards: Undiscounted sum of rewards of each episode, (n,) float64.
            lengths: Length of each episode [control steps], (n,) int64.
            successes: 1.0 for each successful episode and 0.0 for each other episode, (n,) float64, or None if the
                environment does not report success.
            terms: Sum of each reward term over each episode, (n,) float64, by term name.
        """

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Offer to save a checkpoint at a point from which training can be resumed exactly.

        Args:
            steps: Number of environment steps so far, summed over all environments.
            save: :meth:`Algorithm.save`, which is called if the run needs a checkpoint now.

        Raises:
            CheckpointError: The checkpoint cannot be written. Earlier checkpoints remain intact.
        """


class Algorithm(ABC):
    """Base class of algorithms.

    Args:
        env: A vector environment with same-step autoreset. The environment is already seeded, so reset it without a
            seed. A run's environment has the attribute ``recipe``, from which an algorithm can create more environments
            of the same kind in other processes.
        config: Settings as :meth:`resolve_config` returns them. The constructor need not check them again.
        seed: Seed for all random numbers that the algorithm draws, in [0, 2³¹).

    Attributes:
        observation_space: Observation space of a single environment.
        action_space: Action space of a single environment.

    Raises:
        ConfigurationError: The algorithm does not support the spaces, or a setting does not fit the environment.
    """

    observation_space: gym.Space[Any]
    action_space: gym.Space[Any]

    @abstractmethod
    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Any, seed: int) -> None: ...

    @classmethod
    @abstractmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> BaseModel | Mapping[str, Any]:
        """Validate ``config`` and add all defaults: return a pydantic model, or a mapping of YAML-serializable values.

        :func:`frobs_core.util.validation.validate` validates settings with a pydantic model and reports the file and
        line of an error. :func:`frobs_core.util.validation.plain_settings` converts the result to a dictionary. If that
        dictionary is resolved again, the result is the same.

        Raises:
            UnknownParameterError: A key is unknown. The message suggests the most similar valid key.
            ConfigurationError: A value is out of range or of the wrong type. The message includes the key and its
                bounds.
        """

    def check_steps(self, steps: int) -> None:
        """Check whether training until this number of environment steps is possible, before the run folder is made.

        Implementing this method is optional. An algorithm that keeps everything it has seen can report here that the
        memory is too small.

        Raises:
            ConfigurationError: The training run cannot reach this number of steps.
        """
        return

    @abstractmethod
    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Train until the number of environment steps, including steps taken before loading, reaches ``steps``."""

    @abstractmethod
    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations, and the next state of a recurrent policy.

        Predictions, whether deterministic or random, affect neither the learned parameters nor the random generators
        used in training.

        Args:
            observation: Batch of observations, with arrays of shape (num_envs, …).
            state: State of a recurrent policy from the previous call, arrays of any shape, or None at the start.
            episode_start: True for environments whose episode has just begun, (num_envs,) bool.
            deterministic: Whether to return the policy's deterministic actions instead of samples.

        Returns:
            The actions, (num_envs, …), and the next state, or None if the policy is not recurrent.
        """

    def remembered(
        self, state: tuple[np.ndarray[Any, Any], ...] | None, action: Action
    ) -> tuple[np.ndarray[Any, Any], ...] | None:
        """Return the state of a recurrent policy after the environment received other actions than the predicted ones.

        Only an algorithm whose state contains the previous action needs to override this method.

        Args:
            state: State that :meth:`predict` returned, arrays of any shape, or None.
            action: Actions that the environment received, (num_envs, …).

        Returns:
            The state, arrays of the same shapes.
        """
        return state

    @abstractmethod
    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Save to an empty folder all data that :meth:`load` requires.

        Args:
            folder: Empty folder to write to.
            previous: Latest complete checkpoint of this training run, on the same disk, or None. Files that have not
                changed since that checkpoint may be hard links to its files, so that only new data takes disk space.

        Raises:
            OSError: The disk is full, or the folder cannot be written.
        """

    def save_policy(self, folder: Path) -> None:
        """Save to an empty folder all data that :meth:`load` requires for prediction without an environment.

        By default, this method calls :meth:`save`. Override it to omit data that is only needed for training.

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
        """Return the methods whose duration ``frobs bench ID --training`` measures, by part of the training run.

        Implementing this method is optional. The parts are ``"inference"``, which chooses actions and estimates values
        while experience is collected, ``"updates"``, which performs gradient steps, and ``"storage"``, which maintains
        the rollout or replay buffer. Each timed method is replaced on its owner by a wrapper that measures its
        duration, so :meth:`train` must access the method through its owner at each call. If one timed method calls
        another, the inner call's time counts only toward its own part.

        Returns:
            For each part, its methods as (owner, method name) pairs. By default, there are no parts, and only the time
            spent in the environments is measured.
        """
        return {}

    @classmethod
    @abstractmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        """Load the files written by :meth:`save`, without executing any code in these files.

        Args:
            folder: The folder.
            env: Environment in which to continue training, or None to load for prediction only.

        Raises:
            CheckpointError: A file is missing or damaged.
            UntrustedFileError: A file can only be read by executing code that it contains.
        """

    @classmethod
    def load_with(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any], config: Any) -> Self:
        """Load the files written by :meth:`save`, but with other settings, for population-based training.

        Implementing this method is optional. With this method, training can continue with, for example, a different
        learning rate, discount factor or batch size.

        Args:
            folder: The folder.
            env: The environment.
            config: The complete new settings, as :meth:`resolve_config` returns them.

        Raises:
            ConfigurationError: The networks or buffers depend on a setting that was changed, or the algorithm does not
                support changed settings.
            CheckpointError: A file is missing or damaged.
        """
        raise ConfigurationError(
            f"the algorithm {cls.__name__} cannot change its settings during training, because it does not implement "
            "load_with; choose another --pruner."
        )

    def export_onnx(self) -> bytes:
        """Return the deterministic policy as an ONNX graph that maps the raw observation to the executed action.

        Implementing this method is optional. The graph includes all scaling, normalization, squashing and clipping.

        The first axis of every input and output is the batch axis, which can have any size. The input is named
        ``"observation"`` and has the format of the observation space. For a Dict space, each key has an input named
        ``"observation/<key>"``. Recurrent policies have the additional inputs ``"state/0"``, ``"state/1"``, …, which
        are floats and initially zero, and ``"episode_start"``, (batch,) bool. The output is named ``"action"`` and
        contains actions from the action space. For discrete actions, the additional output ``"scores"``, (batch,
        choices) float, contains the scores of all choices; the policy selects the choice with the highest score.
        Recurrent policies have the additional outputs ``"next_state/0"``, ``"next_state/1"``, …

        Raises:
            ConfigurationError: The algorithm cannot be exported, or a package that the export needs is not installed.
        """
        raise PolicyExportError(f"the algorithm {type(self).__name__}", "it has no export_onnx.")
