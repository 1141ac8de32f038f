"""Open the policies of runs, bundles and model files."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from copy import copy
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_cli.errors import CommandLineError
from frobs_core.contracts import Algorithm, Policy
from frobs_core.deprecation import deprecated
from frobs_core.description import Observation
from frobs_core.kernel.policies import load_policy as open_policy_in
from frobs_core.kernel.policies import make_policy
from frobs_core.plugins.registry import bare_id
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import CheckpointError, ModelMismatchError, RunError
from frobs_core.util.yaml import merge
from frobs_train.configuration.config import algorithm_record, differences
from frobs_train.configuration.resolve import read_setting
from frobs_train.export.bundle_run import BundleRun, open_pretrained, open_run_or_bundle
from frobs_train.runs.model_file import is_model_file, load_model_file
from frobs_train.runs.policy_run import PolicyRun
from frobs_train.runs.run import Run

_log = logging.getLogger("frobs")


class AlgorithmPolicy(Policy):
    """Policy of an algorithm, which uses only its ``predict``, with deterministic or sampled actions."""

    def __init__(self, algorithm: Algorithm, deterministic: bool = True) -> None:
        self._algorithm, self._deterministic = algorithm, deterministic
        self._state: tuple[np.ndarray[Any, Any], ...] | None = None

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        action, self._state = self._algorithm.predict(observation, self._state, episode_start, self._deterministic)
        return action

    def remember(self, action: Action) -> None:
        self._state = self._algorithm.remembered(self._state, action)


class TrainedPolicy(Policy):
    """Policy of a run folder, a bundle, or a model file of another library.

    Args:
        path: The path, or a run or bundle that is already open.
        checkpoint: ``"newest"`` for the newest undamaged checkpoint of a run, ``"best"``, or a number of steps.
        deterministic: Whether to use deterministic actions instead of sampling.
        algorithm: Name of a model file's algorithm. By default, the name is read from the file.
        trust: Whether to open a model file that executes code, and a bundle that names files, modules or wrappers.

    Attributes:
        steps: Number of environment steps for which the policy was trained, or 0 before :meth:`bind`.
    """

    def __init__(
        self,
        path: Path | str | Run,
        *,
        checkpoint: str | int = "newest",
        deterministic: bool = True,
        algorithm: str | None = None,
        trust: bool = False,
    ) -> None:
        self._path, self._checkpoint, self._deterministic = path, checkpoint, deterministic
        self._algorithm, self._trust = algorithm, trust
        self._policy: Policy | None = None
        self.steps = 0

    def run(self, environment: str) -> Run | None:
        """Return the run or bundle, which stores the settings of an environment ID, or None for a model file."""
        if isinstance(self._path, Run):
            return self._path
        path = Path(self._path)
        if is_model_file(path):
            return None
        if self._algorithm is not None:
            raise CommandLineError("--algorithm", f"{path} is not a model file, so its algorithm is already known.")
        return open_run_or_bundle(path, self._trust)

    def bind(self, env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> None:
        """Load the policy.

        Raises:
            CheckpointError: The file or checkpoint is missing or damaged.
            UntrustedFileError: The file requires ``trust``.
            RunError: The environment's spaces differ from the spaces used in training, or the file cannot act as
                requested by ``checkpoint`` or ``deterministic``.
        """
        spaces = (
            getattr(env, "single_observation_space", env.observation_space),
            getattr(env, "single_action_space", env.action_space),
        )
        run = self.run(env.spec.id if env.spec is not None else type(env.unwrapped).__name__)
        if self._checkpoint != "newest" and (run is None or isinstance(run, BundleRun)):
            path, what = (self._path, "model file") if run is None else (run.path, "policy bundle")
            raise RunError(f"{path} is a {what}, which contains only one policy; omit --checkpoint.")
        if isinstance(run, BundleRun):
            if not self._deterministic:
                raise RunError(
                    "a policy bundle contains only the deterministic policy, so actions cannot be sampled from it."
                )
            self._policy, self.steps = run.policy(*spaces), run.steps
            return
        if run is None:
            algorithm, self.steps = load_model_file(Path(str(self._path)), *spaces, self._algorithm, self._trust)
        else:
            algorithm, self.steps = load_algorithm(run, *spaces, self._checkpoint)
        self._policy = AlgorithmPolicy(algorithm, self._deterministic)

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        assert self._policy is not None, "bind() was not called"
        return self._policy.act(observation, episode_start)

    def remember(self, action: Action) -> None:
        assert self._policy is not None, "bind() was not called"
        self._policy.remember(action)


class PretrainedPolicy(TrainedPolicy):
    """Trained policy that comes with the ID of the environment."""

    def __init__(self) -> None:
        super().__init__("pretrained")

    def run(self, environment: str) -> Run:
        return open_pretrained(environment)


def open_policy(
    target: Path | str,
    policy: Path | str | None = None,
    *,
    settings: Sequence[str] = (),
    algorithm: str | None = None,
    trust: bool = False,
) -> Run:
    """Open a policy together with the settings of the environment in which it acts.

    Args:
        target: Run folder or bundle. If ``policy`` is given, the Gymnasium ID of the environment.
        policy: Name or path of the policy, see :func:`~frobs_core.kernel.policies.load_policy`.
        settings: Assignments to keys of :class:`frobs_train.RunConfig`. For a trained policy, which has settings of its
            own, only to ``environment_kwargs.simulator_kwargs``, whose values from training are then not used.
        algorithm: Algorithm of a model file.
        trust: See ``TrainedPolicy``.

    Returns:
        The run or bundle, or a :class:`~frobs_train.runs.policy_run.PolicyRun` for other policies.

    Raises:
        FrobsError: The policy or the ID does not exist, was trained in another environment, or does not use a setting.
        BundleError: The file is not a bundle.
    """
    if policy is None:
        return _with_simulator_kwargs(open_run_or_bundle(target, trust), settings)
    environment = str(target)
    options = {name: value for name, value in (("algorithm", algorithm), ("trust", trust)) if value}
    unbound = make_policy(policy, **options)
    run = unbound.run(environment) if isinstance(unbound, TrainedPolicy) else None
    if run is None:
        return PolicyRun(policy, environment, settings, **options)
    trained, requested = bare_id(run.config.environment), bare_id(environment)
    if trained != requested:
        raise ModelMismatchError(f"policy '{policy}'", "the ID", f"'{trained}'", f"'{requested}'")
    return _with_simulator_kwargs(run, settings)


def _with_simulator_kwargs(run: Run, settings: Sequence[str]) -> Run:
    """Return a run whose simulator has the given settings instead of those from training."""
    for setting in settings:
        if setting.partition("=")[0].strip().split(".")[:2] != ["environment_kwargs", "simulator_kwargs"]:
            raise CommandLineError(
                f"--set {setting:.80}",
                "a trained policy stores its own settings; only environment_kwargs.simulator_kwargs can be set.",
            )
    if not settings:
        return run
    changed, kwargs = copy(run), merge(*map(read_setting, settings))["environment_kwargs"]
    kwargs = {**run.config.environment_kwargs, **kwargs}
    changed.config = run.config.model_copy(update={"environment_kwargs": kwargs})
    changed.simulator_kwargs = kwargs["simulator_kwargs"]
    return changed


def acting_policy(run: Run, env: Any, checkpoint: str | int = "newest", deterministic: bool = True) -> Policy:
    """Return the policy of a run or of what :func:`open_policy` returns, ready to act in an environment.

    For ``checkpoint``, ``deterministic`` and errors, see ``TrainedPolicy``.
    """
    options: dict[str, Any] = {} if checkpoint == "newest" else {"checkpoint": checkpoint}
    if not deterministic:
        options["deterministic"] = False
    if isinstance(run, PolicyRun):
        return open_policy_in(run.policy, env, **run.options, **options)
    policy = TrainedPolicy(run, **options)
    policy.bind(env)
    return policy


@deprecated(instead="frobs_core.load_policy", since="0.3", removed_in="0.4")
def load_policy(
    run: Run, observation_space: gym.Space[Any], action_space: gym.Space[Any], checkpoint: str | int = "newest"
) -> tuple[Algorithm, int]:
    """Return :func:`load_algorithm` for the same arguments."""
    return load_algorithm(run, observation_space, action_space, checkpoint)


def load_algorithm(
    run: Run, observation_space: gym.Space[Any], action_space: gym.Space[Any], checkpoint: str | int = "newest"
) -> tuple[Algorithm, int]:
    """Load a checkpoint of a run, which may still be training, for predictions in an environment with these spaces.

    For ``checkpoint``, see ``TrainedPolicy``. The result is the algorithm, and its number of training steps.
    """
    if run.edited is not None:
        keys = ", ".join(key for key, _, _ in differences(run.config.model_dump(), run.edited.model_dump()))
        _log.warning(
            "%s was edited: %s. The edits are ignored, and the values from training are used.",
            run.path / "config.yaml",
            keys,
        )
    algorithm, steps = _load(run, checkpoint)
    for what, trained, now in (
        ("observation", algorithm.observation_space, observation_space),
        ("action", algorithm.action_space, action_space),
    ):
        if trained != now:
            raise RunError(
                f"{run.path}: the policy was trained with {what} space {trained}, but the space of the environment is "
                f"{now}; use the same keyword arguments as in training."
            )
    return algorithm, steps


def _load(run: Run, which: str | int, attempts: int = 3) -> tuple[Algorithm, int]:
    """Load a checkpoint, and try again if a running training process has removed the checkpoint."""
    checkpoint, damaged = run.find_checkpoint(which)
    for line in damaged:
        _log.warning("%s The previous checkpoint is used.", line)
    try:
        algorithm: Algorithm = algorithm_record(run.config.algorithm).load().load(checkpoint.path / "algorithm")
    except CheckpointError:
        if checkpoint.path.exists() or attempts == 1:
            raise
        return _load(run, which, attempts - 1)
    return algorithm, checkpoint.steps
