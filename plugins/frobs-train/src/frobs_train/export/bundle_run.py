"""Open policy bundles as objects with the interface of a run, so that bundles can be evaluated and played."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import gymnasium as gym

import frobs_deploy
from frobs_core.contracts import Policy
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.validation import validate
from frobs_deploy import Bundle, BundleError, BundleMismatchError, read_bundle
from frobs_train.configuration.config import RunConfig
from frobs_train.environments import make_vector_env
from frobs_train.export.export_facts import environment_facts, spaces_facts
from frobs_train.export.pretrained import claimed_evaluation, read_pretrained
from frobs_train.export.untrusted import check_config
from frobs_train.runs.run import Run


class BundleRun(Run):
    """A policy bundle with the interface of a run. ``path`` is the bundle file.

    Args:
        bundle: Content of the bundle file.
        trust: Whether the environment may load what ``frobs_train/export/untrusted.py`` does not list.

    Attributes:
        bundle: Content of the bundle file.
        steps: Number of environment steps for which the policy was trained.

    Raises:
        BundleError: The bundle does not contain a valid training configuration.
        UntrustedFileError: ``trust`` is False, and the configuration names something that it may not load.
    """

    def __init__(self, bundle: Bundle, trust: bool = False) -> None:
        training = bundle.manifest.get("training")
        if not isinstance(training, Mapping) or not isinstance(training.get("config"), Mapping):
            raise BundleError(
                bundle.path,
                "the bundle does not contain the training configuration, so the policy's environment is unknown; "
                "export the policy again.",
            )
        super().__init__(bundle.path, validate(RunConfig, training["config"], f"the configuration in {bundle.path}"))
        if not trust:
            check_config(bundle.path, self.config)
        self.bundle = bundle
        if self.config.seed is None:
            raise BundleError(bundle.path, "the training configuration has no seed; export the policy again.")
        steps = training.get("steps")
        if steps is not None and (isinstance(steps, bool) or not isinstance(steps, int) or not 0 <= steps < 2**63):
            raise BundleError(
                bundle.path, "training.steps is not a number of environment steps; export the policy again."
            )
        self.steps = steps or 0

    @property
    def success_rate(self) -> float | None:
        """Success rate in the simulator of the training, from the evaluation with the most episodes, or None."""
        return (claimed_evaluation(self.bundle) or {}).get("success_rate")

    def policy(self, observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> BundlePolicy:
        """Return the policy for the spaces of a single environment.

        Raises:
            BundleMismatchError: The spaces differ from those that the policy was trained with.
        """
        trained = {
            "observation": self.bundle.manifest["observation"]["spaces"],
            "action": self.bundle.manifest["action"]["space"],
        }
        for what, now in spaces_facts(observation_space, action_space).items():
            if trained[what] != now:
                raise BundleMismatchError(
                    self.path,
                    f"the environment's {what} space differs from the one that the policy was trained with; use the "
                    "same environment version and keyword arguments as in training.",
                )
        return BundlePolicy(self.bundle)


class BundlePolicy(Policy):
    """Adapter for :class:`frobs_deploy.Policy`, which does not depend on the core."""

    def __init__(self, bundle: Bundle) -> None:
        self._policy = frobs_deploy.Policy(bundle)

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        self._policy.reset(None if episode_start.all() else episode_start)
        return cast("Action", self._policy.act(observation))


def open_pretrained(environment: str) -> BundleRun:
    """Open the trained policy of an environment ID as an object with the interface of a run.

    Args:
        environment: Environment ID, optionally in the form ``frobs_core:frobs/…``.

    Raises:
        UnknownNameError: The ID does not exist.
        RunError: The ID has no trained policy.
        BundleError: The file is missing or damaged, or belongs to another ID.
        ConfigurationError: The configuration in the file is damaged.
    """
    return BundleRun(read_pretrained(environment), trust=True)  # trusted as part of an installed distribution


def changes_since(run: BundleRun) -> list[str]:
    """Return one line for each fact about the environment that has changed since the policy was exported.

    The policy may still run after a change, but it may fail the task.
    """
    env = make_vector_env(run.config.environment, 1, run.config.keywords(randomize=False), run.config.wrappers)
    try:
        now = environment_facts(env, run.config)
    finally:
        env.close()
    return list(_changes(run.bundle.manifest, now))


def _changes(then: Any, now: Any, name: str = "") -> Iterator[str]:
    """Yield one line for each value of ``now`` that differs from the value in ``then``."""
    if isinstance(then, Mapping) and isinstance(now, Mapping):
        for key in now:
            if key in then:  # ignore fields that were added after the export
                yield from _changes(then[key], now[key], f"{name}.{key}" if name else str(key))
    elif then != now:
        yield f"{name} was {then}, and is now {now}"


def open_run_or_bundle(path: Path | str, trust: bool = False) -> Run:
    """Open a run folder or a policy bundle. See :class:`BundleRun` for the meaning of ``trust``."""
    path = Path(path)
    return BundleRun(read_bundle(path), trust) if path.exists() and not path.is_dir() else Run.open(path)
