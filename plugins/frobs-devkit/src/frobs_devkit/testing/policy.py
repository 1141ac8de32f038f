"""Conformance checks for policies."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core import load_policy, plugins
from frobs_core.contracts import Policy
from frobs_core.kernel.policies import find_policy, is_path
from frobs_core.plugins.records import PolicyRecord
from frobs_core.util.keywords import constructor_parameters
from frobs_devkit.testing.checks import Check, Inconclusive, NotApplicable, after, checks_of, collect, expect
from frobs_devkit.testing.compare import batch_of_one, expect_same, row
from frobs_devkit.testing.environment.under_test import EnvUnderTest, is_ours

_ENVS, _STEPS, _SEED = 3, 20, 5


@dataclass(frozen=True)
class PolicyUnderTest:
    """A policy by name or path, and the environment in which it acts."""

    name: str | Path
    env: EnvUnderTest

    @property
    def record(self) -> PolicyRecord:
        """The policy's record."""
        found = find_policy(self.name) if is_path(self.name) else plugins.get_record("policy", str(self.name))
        return cast("PolicyRecord", found)

    @contextmanager
    def acting(self, num_envs: int = _ENVS) -> Iterator[tuple[Policy, Any, Any]]:
        """Bind a new policy to a new vector or (0) single environment, and yield both with the first observation."""
        if not self.env.id:
            raise Inconclusive("the policy needs an environment; name one: --set environment=ID")
        made: Any = self.env.make_vec(num_envs, AutoresetMode.SAME_STEP) if num_envs else self.env.make()
        with closing(made), closing(load_policy(self.name, made)) as policy:
            yield policy, made, made.reset(seed=_SEED)[0]


def record_loads(subject: PolicyUnderTest) -> None:
    """The entry point is a subclass of Policy, and its suffixes are a tuple of strings."""
    record = subject.record
    cls = record.load()
    expect(
        inspect.isclass(cls) and issubclass(cls, Policy) and not inspect.isabstract(cls),
        f"{record.entry_point} is {cls!r}, not a complete subclass of Policy.",
    )
    expect(
        isinstance(record.suffixes, tuple) and all(isinstance(suffix, str) for suffix in record.suffixes),
        f"suffixes is {record.suffixes!r}; it must be a tuple of strings.",
    )


@after("record_loads")
def actions_are_in_the_action_space(subject: PolicyUnderTest) -> None:
    """In a single and in a vector environment, actions have the batched shape and lie in the action space.

    The arrays of ``info`` have a row for each environment, and the policy can be closed twice.
    """
    for num_envs in (0, _ENVS):
        with subject.acting(num_envs) as (policy, env, observation):
            single = getattr(env, "single_action_space", env.action_space)
            space = gym.vector.utils.batch_space(single, max(num_envs, 1))
            for action in _play(policy, env, observation):
                if space.dtype is not None:
                    shape = np.shape(action)
                    expect(shape == space.shape, f"the actions have the shape {shape}, not {space.shape}.")
                    action = np.asarray(action, space.dtype)
                expect(space.contains(action), f"the actions {action} are not in the action space {space}.")
            for name, values in policy.info().items():
                shape, rows = np.shape(values), max(num_envs, 1)
                expect(shape[:1] == (rows,), f"'{name}' in info() has the shape {shape}, not ({rows}, …).")
            policy.close()
            policy.close()


@after("actions_are_in_the_action_space")
def actions_repeat_with_the_seed(subject: PolicyUnderTest) -> None:
    """Two new policies act alike in two environments that were reset with the same seed."""
    runs = []
    for _ in range(2):
        with subject.acting() as (policy, env, observation):
            runs.append([deepcopy(action) for action in _play(policy, env, observation)])
    expect_same(runs[0], runs[1], "the actions of two policies in environments with the same seed")


@after("actions_repeat_with_the_seed")
def episode_start_resets_its_rows(subject: PolicyUnderTest) -> None:
    """Where an episode starts, the policy acts like a new policy. Other rows are not affected."""
    if "seed" in constructor_parameters(subject.record.load()):
        raise NotApplicable("the policy has a seed, so it draws random actions")
    first = np.arange(_ENVS) == 0
    with subject.acting() as (policy, env, observation), subject.acting() as (other, twin, _):
        if not is_ours(env):
            raise NotApplicable("only environments of FRobs can reset some of their rows")
        begun = deepcopy(policy.act(observation, np.ones(_ENVS, np.bool_)))
        for each, of in ((policy, env), (other, twin)):
            for _ in _play(each, of, observation):
                pass
        seen, same = (of.reset(seed=_SEED, options={"reset_mask": first})[0] for of in (env, twin))
        reset = deepcopy(policy.act(seen, first))
        kept = other.act(same, np.zeros(_ENVS, np.bool_))
        expect_same(row(begun, 0), row(reset, 0), "the first action of a later episode with the same seed")
        for i in range(1, _ENVS):
            expect_same(row(kept, i), row(reset, i), f"row {i}, although only the episode of row 0 has just begun")


CHECKS = checks_of(sys.modules[__name__])
"""All policy checks, in the order in which they run."""


def check_policy(policy: str | Path, environment: str = "", **kwargs: Any) -> list[Check]:
    """Return the conformance checks for a policy.

    Args:
        policy: Name or path of the policy, see :func:`~frobs_core.kernel.policies.load_policy`.
        environment: Gymnasium ID of the environment in which the policy acts. Without it, only the record is checked.
        **kwargs: Keyword arguments of the environment.
    """
    return collect(PolicyUnderTest(policy, EnvUnderTest(environment, kwargs)), CHECKS)


def _play(policy: Policy, env: Any, observation: Any) -> Iterator[Any]:
    start = np.ones(getattr(env, "num_envs", 1), np.bool_)
    is_vector = isinstance(env, gym.vector.VectorEnv)
    for _ in range(_STEPS):
        action = policy.act(observation if is_vector else batch_of_one(observation), start)
        yield action
        observation, _, terminated, truncated, _ = env.step(action if is_vector else row(action, 0))
        start = np.atleast_1d(terminated | truncated)
        if not is_vector and start.all():
            return
