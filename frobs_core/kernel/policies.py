"""Opens policies by name or path, and the policies of the core: experts and random actions."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np

from frobs_core import plugins
from frobs_core.contracts.policy import Environment, Policy
from frobs_core.deprecation import deprecated, warn_deprecated
from frobs_core.description.observation_term import Observation
from frobs_core.kernel.mixed_vector_env import MixedVectorEnv
from frobs_core.plugins.records import PolicyRecord
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.attributes import load_attribute
from frobs_core.util.errors import PluginError, RunError, UnknownParameterError
from frobs_core.util.install_hints import local_install_hint
from frobs_core.util.keywords import constructor_parameters


def load_policy(name: str | Path, env: Environment, **options: Any) -> Policy:
    """Open a policy that acts in an environment.

    Args:
        name: Name from ``frobs list policies``, or a path, such as ``"runs/first"`` or ``"reach.frobs"``.
        env: A single or vector environment, before its first reset.
        options: Keyword arguments of the policy, such as ``checkpoint="best"`` for a run folder.

    Raises:
        PluginError: No installed plugin provides the name or opens the path.
        FrobsError: The policy has no such option, or cannot act in this environment.
    """
    policy = make_policy(name, **options)
    policy.bind(env)
    return policy


def make_policy(name: str | Path, **options: Any) -> Policy:
    """Return a policy that is not yet bound to an environment. For arguments and errors, see :func:`load_policy`."""
    record = find_policy(name)
    cls: type[Policy] = record.load()
    path = [Path(name)] if record.suffixes else []
    accepted = [*constructor_parameters(cls)][len(path) :]
    for option in options:
        if option not in accepted:
            raise UnknownParameterError(f"policy '{name}'", option, accepted)
    return cls(*path, **options)


def is_path(name: str | Path) -> bool:
    """Return whether the name of a policy is a path, which contains ``/``, the system's separator, or ``.``."""
    return isinstance(name, Path) or "." in name.rpartition(":")[2] or "/" in name or os.sep in name


def find_policy(name: str | Path) -> PolicyRecord:
    """Return the record of the policy that has a name or opens a path. For errors, see :func:`load_policy`."""
    text = os.fspath(name)
    if not is_path(name):
        record = cast("PolicyRecord", plugins.get_record("policy", text))
        if record.suffixes:
            raise PluginError(f"policy '{text}' opens paths; write the path instead of the name, such as 'runs/first'.")
        return record
    ending = f"{text}/" if os.path.isdir(text) else text
    records = plugins.records(PolicyRecord)
    fits = [(len(end), key) for key, record in records.items() for end in record.suffixes if ending.endswith(end)]
    longest = [key for length, key in fits if length == max(fits)[0]]
    if not fits:
        hint = local_install_hint(plugins.install_command("policy", "trained"))
        raise PluginError(f"no installed policy opens {text}; to open run folders, bundles and model files: {hint}.")
    if len(longest) > 1:
        raise PluginError(f"{text} is opened by several policies: {', '.join(longest)}; uninstall all but one.")
    return records[longest[0]]


class TaskExpert(Policy):
    """The scripted expert of the environment's task. On several simulators, each has its own expert."""

    def bind(self, env: Environment) -> None:
        """Create the expert. Experts of version 0.2 have ``__init__(env)`` and ``act(episode_start)``.

        Raises:
            RunError: The task has no expert.
        """
        base: Any = env.unwrapped
        self._parts: list[TaskExpert] = []
        if isinstance(base, MixedVectorEnv):
            self._split = base.split
            for part in base.parts.values():
                part.spec = env.spec  # for error messages
                self._parts.append(TaskExpert())
                self._parts[-1].bind(part)
            return
        expert: str = getattr(getattr(base, "task", None), "expert", "")
        if not expert:
            id = env.spec.id if env.spec is not None else type(base).__name__
            raise RunError(f"the task of {id} has no scripted expert; use another policy: frobs list policies.")
        cls = load_attribute(expert)
        self.takes_observation = len(inspect.signature(cls.act).parameters) > 2
        if self.takes_observation:
            self.expert = cls()
            self.expert.bind(env)
        else:
            new = "bind(env) and act(observation, episode_start)"
            warn_deprecated(f"__init__(env) of expert {cls.__qualname__}", instead=new, since="0.3", removed_in="0.4")
            self.expert = cls(base)

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        if self._parts:
            rows = zip(self._parts, self._split(observation), self._split(episode_start), strict=True)
            return np.concatenate([part.act(seen, start) for part, seen, start in rows])
        arguments = (observation, episode_start) if self.takes_observation else (episode_start,)
        return cast("Action", self.expert.act(*arguments))

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        if self._parts:
            infos = [part.info() for part in self._parts]
            return {name: np.concatenate([info[name] for info in infos]) for name in infos[0]}
        facts: Mapping[str, np.ndarray[Any, Any]] = self.expert.info()
        return facts

    def close(self) -> None:
        for expert in self._parts or [self.expert]:
            expert.close()


@deprecated(instead="frobs_core.load_policy('expert', env)", since="0.3", removed_in="0.4")
def load_expert(env: Environment) -> Any:
    """Return the expert of the environment's task, whose ``act`` takes only ``episode_start``, or None."""
    policy = TaskExpert()
    try:
        policy.bind(env)
    except RunError:
        return None
    if policy.takes_observation:
        policy.expert.act = partial(policy.expert.act, None)
    return policy.expert


class RandomPolicy(Policy):
    """Random actions, drawn from the action space.

    Args:
        seed: Seed of the actions, ≥ 0.
    """

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed

    def bind(self, env: Environment) -> None:
        """Copy the action space, because its own random numbers belong to the environment."""
        space = deepcopy(getattr(env, "single_action_space", env.action_space))
        self._space = gym.vector.utils.batch_space(space, getattr(env, "num_envs", 1))
        self._space.seed(self._seed)

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        return cast("Action", self._space.sample())
