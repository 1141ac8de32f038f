"""Opens policies by name or path, and the two policies of the core: experts and random actions."""

from __future__ import annotations

import os
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np

from frobs_core import plugins
from frobs_core.contracts.policy import Environment, Policy, bound_expert
from frobs_core.description.observation_term import Observation
from frobs_core.plugins.records import PolicyRecord
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import AmbiguousNameError, PluginError, RunError, UnknownParameterError
from frobs_core.util.keywords import constructor_parameters


def load_policy(name: str | Path, env: Environment, **options: Any) -> Policy:
    """Open a policy that acts in an environment.

    Args:
        name: Name from ``frobs list policies``, such as ``"expert"``, ``"random"`` or ``"pretrained"``, or a path, such
            as ``"runs/first"``, ``"reach.frobs"`` or ``"model.zip"``. A string with ``/`` or ``.`` is a path.
        env: A single or vector environment, before its first reset.
        options: Keyword arguments of the policy, such as ``checkpoint="best"`` for a run folder.

    Returns:
        The policy. Call :meth:`~frobs_core.contracts.Policy.close` after the last action.

    Raises:
        UnknownNameError: No installed plugin provides the policy. The message lists the names, and what to install.
        PluginError: No installed plugin opens the path.
        UnknownParameterError: The policy has no such option.
        FrobsError: The policy cannot act in this environment.
    """
    policy = make_policy(name, **options)
    policy.bind(env)
    return policy


def make_policy(name: str | Path, **options: Any) -> Policy:
    """Return a policy that is not yet bound to an environment. For the arguments and errors, see :func:`load_policy`."""
    record = find_policy(name)
    cls: type[Policy] = record.load()
    path = [Path(name)] if record.suffixes else []
    accepted = [*constructor_parameters(cls)][len(path) :]
    for option in options:
        if option not in accepted:
            raise UnknownParameterError(f"policy '{name}'", option, accepted)
    return cls(*path, **options)


def is_path(name: str | Path) -> bool:
    """Return whether the name of a policy is a path: it contains ``/``, the system's separator, or ``.``."""
    return isinstance(name, Path) or "." in name.rpartition(":")[2] or "/" in name or os.sep in name


def find_policy(name: str | Path) -> PolicyRecord:
    """Return the record of a policy with a name, or of the policy that opens a path. For errors, see `load_policy`."""
    text = os.fspath(name)
    if not is_path(name):
        record = cast("PolicyRecord", plugins.get_record("policy", text))
        if record.suffixes:
            raise PluginError(f"policy '{text}' has no path; write the path instead of the name, such as 'runs/first'.")
        return record
    ending = f"{text}/" if os.path.isdir(text) else text
    records = cast("Mapping[str, PolicyRecord]", plugins.records("policy"))
    lengths = {
        key: max((len(suffix) for suffix in record.suffixes if ending.endswith(suffix)), default=-1)
        for key, record in records.items()
    }
    best = [key for key, length in lengths.items() if length == max(lengths.values()) >= 0]
    if not best:
        hint = plugins.install_command("policy", "trained")
        raise PluginError(f"no installed policy opens {text}; to open run folders, bundles and model files: {hint}.")
    if len(best) > 1:
        origins = [plugins.get_report("policy", key).origin for key in best]
        raise AmbiguousNameError("policy", text, origins, best)
    return records[best[0]]


class ExpertPolicy(Policy):
    """The scripted expert of an environment's task.

    Raises:
        RunError: The environment's task has no expert.
        ConfigurationError: The expert does not support the environment's controllers.
    """

    def bind(self, env: Environment) -> None:
        """Load the expert that the task names."""
        expert = bound_expert(env)
        if expert is None:
            name = env.spec.id if env.spec is not None else type(env.unwrapped).__name__
            raise RunError(f"the task of {name} has no scripted expert; use another policy: frobs list policies.")
        self._expert = expert

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        """Return the expert's actions."""
        return self._expert.act(observation, episode_start)

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return the expert's facts."""
        return self._expert.info()

    def close(self) -> None:
        """Close the expert."""
        if hasattr(self, "_expert"):
            self._expert.close()


class RandomPolicy(Policy):
    """Random actions, drawn from the action space.

    Args:
        seed: Seed of the actions, ≥ 0.
    """

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed

    def bind(self, env: Environment) -> None:
        """Copy the action space, so that the environment's own random numbers are not used."""
        space = getattr(env, "single_action_space", env.action_space)
        self._space = gym.vector.utils.batch_space(deepcopy(space), getattr(env, "num_envs", 1))
        self._space.seed(self._seed)

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        """Return random actions."""
        return cast("Action", self._space.sample())
