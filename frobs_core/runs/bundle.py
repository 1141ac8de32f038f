"""A policy bundle in the place of a run, so that it is evaluated and played in its environment as any run is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn, Self

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action, Mask
from frobs_core.deploy import Bundle, Policy, read_bundle
from frobs_core.errors import BundleError, BundleMismatchError, RunError
from frobs_core.interfaces.algorithm import Algorithm, TrainingMonitor
from frobs_core.interfaces.task import Observation
from frobs_core.runs.config import RunConfig
from frobs_core.runs.export_facts import spaces_facts
from frobs_core.runs.run import Run
from frobs_core.validation import validate


class BundleRun(Run):
    """What a bundle says about the run that it came from, and its policy.

    Attributes:
        path: The bundle.
        config: Of the run.
        bundle: What was read.
    """

    def __init__(self, bundle: Bundle) -> None:
        training = bundle.manifest.get("training")
        if not isinstance(training, Mapping) or not isinstance(training.get("config"), Mapping):
            raise BundleError(
                bundle.path, "does not say how its policy was trained, so there is nothing to play it in."
            )
        super().__init__(bundle.path, validate(RunConfig, training["config"], f"the configuration in {bundle.path}"))
        self.bundle = bundle
        self.steps = int(training.get("steps") or 0)

    def load_policy(self, observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> tuple[BundlePolicy, int]:
        """Return the policy, and the environment steps that it had trained for.

        Raises:
            BundleMismatchError: The environment's spaces are not those of the training.
        """
        policy = Policy(self.bundle)
        trained = {
            "observation": self.bundle.manifest["observation"]["spaces"],
            "action": self.bundle.manifest["action"]["space"],
        }
        for what, now in spaces_facts(observation_space, action_space).items():
            if trained[what] != now:
                raise BundleMismatchError(
                    self.path,
                    f"the policy was trained with another {what} space than the environment's; use the environment's "
                    "keywords and version of the training.",
                )
        return BundlePolicy(policy, observation_space, action_space), self.steps


class BundlePolicy(Algorithm):
    """A bundle's policy as an algorithm that can only predict.

    Args:
        policy: The policy.
        observation_space: Of one environment.
        action_space: Of the same.
    """

    def __init__(self, policy: Policy, observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> None:
        self._policy = policy
        self.observation_space, self.action_space = observation_space, action_space

    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations; the policy keeps its state itself.

        Raises:
            RunError: Others than the mode are asked for.
        """
        if not deterministic:
            raise RunError("a policy bundle holds the mode of the policy alone: it cannot be sampled.")
        if episode_start is None or episode_start.all():
            self._policy.reset()
        else:
            self._policy.reset(episode_start)
        return self._policy.act(observation), None

    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        """Refuse.

        Raises:
            RunError: Always.
        """
        _refuse()

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Refuse.

        Raises:
            RunError: Always.
        """
        _refuse()

    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Refuse.

        Raises:
            RunError: Always.
        """
        _refuse()

    @classmethod
    def load(cls, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any] | None = None) -> Self:
        """Refuse.

        Raises:
            RunError: Always.
        """
        _refuse()


def open_run_or_bundle(path: Path | str) -> Run:
    """Open a run folder, or a policy bundle in the place of one.

    Raises:
        RunError: It is a folder, and no run's.
        BundleError: It is a file, and no bundle.
        ConfigurationError: The configuration in it is damaged.
    """
    return BundleRun(read_bundle(path)) if Path(path).is_file() else Run.open(path)


def _refuse() -> NoReturn:
    raise RunError("a policy bundle can only act; train the run that it came from.")
