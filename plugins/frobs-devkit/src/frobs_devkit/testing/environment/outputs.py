"""Checks of returned data: spaces, finite numbers, shared memory and constant elements."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core.description import VECTORS
from frobs_devkit.testing.checks import CheckFailure, expect
from frobs_devkit.testing.compare import expect_array, expect_same, leaves
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.under_test import EnvUnderTest

_STEPS = 150
_SEEDS = range(20)


def spaces_hold(subject: EnvUnderTest) -> None:
    """Observations match their spaces, rewards are numbers, and ``terminated`` and ``truncated`` are bool.

    This applies to single environments and to batches.
    """
    with closing(subject.make()) as env:
        for k, observation, result in _returned(env):
            _expect_member(env.observation_space, observation, f"step {k}")
            if result is None:
                continue
            reward, terminated, truncated, info = result
            expect(isinstance(reward, float | int | np.floating), f"step {k}: the reward is {reward!r}, not a number.")
            for name, end in (("terminated", terminated), ("truncated", truncated)):
                expect(isinstance(end, bool | np.bool_), f"step {k}: {name} is {end!r}, not a bool.")
            expect(isinstance(info, dict), f"step {k}: the info is {type(info).__name__}, not a dict.")
    with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as env:
        observation, _ = env.reset(seed=0)
        for k, action in enumerate(draw_actions(env.action_space, _STEPS, seed=0)):
            _expect_member(env.observation_space, observation, f"the batch, step {k}")
            observation, reward, terminated, truncated, _ = env.step(action)
            expect_array(reward, (3,), np.float64, f"the batch, step {k}: the reward")
            expect_array(terminated, (3,), np.bool_, f"the batch, step {k}: terminated")
            expect_array(truncated, (3,), np.bool_, f"the batch, step {k}: truncated")


def values_finite(subject: EnvUnderTest) -> None:
    """All numbers in observations, rewards and infos are finite."""
    with closing(subject.make()) as env:
        for k, observation, result in _returned(env):
            parts: dict[str, Any] = {"the observation": observation}
            if result is not None:
                parts |= {"the reward": result[0], "the info": result[3]}
            for what, part in parts.items():
                for path, leaf in leaves(part).items():
                    if leaf.dtype.kind == "f" and not np.isfinite(leaf).all():
                        where = np.argwhere(~np.isfinite(leaf)).tolist()[:3]
                        raise CheckFailure(f"step {k}: {what}{path} is not finite at {where}: {leaf}.")


def observations_share_no_memory(subject: EnvUnderTest) -> None:
    """Neither a single environment nor a batch overwrites an observation that it has returned."""
    with closing(subject.make()) as env:
        _expect_own_memory((observation for _, observation, _ in _returned(env)), "the environment")
    with closing(subject.make_vec(2, AutoresetMode.SAME_STEP)) as env:
        _expect_own_memory(_batched_observations(env), "the batch")


def observation_elements_vary(subject: EnvUnderTest) -> None:
    """No observation element is constant over random episodes, and goals differ between episodes.

    An element of the desired goal may be constant if the same element of the achieved goal varies. For example, all
    goals on a floor have the same height. At least one element of the desired goal must differ between episodes. The
    background of a picture, (h, w, c) uint8, may be constant, too.
    """
    seen: dict[str, list[np.ndarray[Any, Any]]] = {}
    first: dict[str, list[np.ndarray[Any, Any]]] = {}
    with closing(subject.make()) as env:
        late = _late_columns(env)
        for seed in _SEEDS:
            for k, observation, _ in _returned(env, steps=12, seed=seed):
                for path, leaf in leaves(deepcopy(observation)).items():
                    seen.setdefault(path, []).append(leaf)
                    if k == 0:
                        first.setdefault(path, []).append(leaf)
    for path, values in seen.items():
        goal = path == "['desired_goal']"
        rows = np.stack(first[path] if goal else values)  # (k, …)
        constant = _constant_elements(rows)
        if goal and len(constant) < rows[0].size:
            achieved = _constant_elements(np.stack(seen["['achieved_goal']"]))
            constant = [where for where in constant if where in achieved]
        if rows.dtype == np.uint8 and rows.ndim == 4 and len(constant) < 0.99 * rows[0].size:
            constant = []
        if path in ("", "['observation']"):
            constant = [where for where in constant if where[0] not in late]
        over = f"{len(_SEEDS)} seeds" if goal else f"{len(rows)} steps of {len(_SEEDS)} random episodes"
        expect(
            not constant,
            f"observation{path}: {len(constant)} of {rows[0].size} elements are constant over {over}, at the indices "
            f"{constant[:8]}; remove these elements, because they carry no information.",
        )


def _constant_elements(rows: np.ndarray[Any, Any]) -> list[list[int]]:
    return np.argwhere((rows == rows[0]).all(axis=0)).tolist()


def _late_columns(env: gym.Env[Any, Any]) -> set[int]:
    """Return the observation columns of the task's ``late_terms``, which may stay constant in random episodes."""
    base: Any = env.unwrapped
    if not hasattr(base, "observations"):
        return set()
    columns = base.observations.columns
    parts = [columns[term] for term in base.task.late_terms if term in columns]
    return {column for key, part in parts if key == VECTORS for column in range(part.start, part.stop)}


def _returned(env: gym.Env[Any, Any], steps: int = _STEPS, seed: int = 0) -> Iterator[tuple[int, Any, Any]]:
    """Play random episodes, and yield the step number, the observation and the other values returned by ``step``."""
    observation, _ = env.reset(seed=seed)
    yield 0, observation, None
    for k, action in enumerate(draw_actions(env.action_space, steps, seed), start=1):
        observation, *result = env.step(action)
        yield k, observation, result
        if result[1] or result[2]:
            yield k, env.reset()[0], None


def _batched_observations(env: gym.vector.VectorEnv[Any, Any, Any]) -> Iterator[Any]:
    yield env.reset(seed=0)[0]
    for action in draw_actions(env.action_space, _STEPS, seed=0):
        observation, _, terminated, truncated, info = env.step(action)
        if (terminated | truncated).any():
            finals = info.get("final_obs", ())
            yield from (final for final in finals if final is not None)
        yield observation


def _expect_own_memory(observations: Iterator[Any], whose: str) -> None:
    kept: list[tuple[Any, Any]] = []
    for observation in observations:
        if kept:
            for path, leaf in leaves(observation).items():
                before = leaves(kept[-1][0]).get(path)
                shares = before is not None and np.may_share_memory(before, leaf)
                expect(
                    not shares,
                    f"{whose} returns observations of different steps that share memory (observation{path}); return a "
                    "copy.",
                )
        kept = [*kept[-3:], (observation, deepcopy(observation))]
        for old, copy in kept[:-1]:
            expect_same(copy, old, f"{whose} overwrites an observation that it returned at an earlier step")


def _expect_member(space: gym.Space[Any], observation: Any, when: str) -> None:
    if isinstance(space, gym.spaces.Box) and isinstance(observation, np.ndarray):
        expect_array(observation, space.shape, space.dtype, f"{when}: the observation")
        outside = np.argwhere(~((observation >= space.low) & (observation <= space.high))).tolist()
        if outside:
            i = tuple(outside[0])
            raise CheckFailure(
                f"{when}: the observation is outside its space at the indices {outside[:8]}: {observation[i]} is not "
                f"in [{space.low[i]}, {space.high[i]}]."
            )
    if isinstance(space, gym.spaces.Dict) and isinstance(observation, dict):
        same = space.keys() == observation.keys()
        expect(same, f"{when}: keys {sorted(observation)}, but its space has {sorted(space)}.")
        for key, part in space.items():
            _expect_member(part, observation[key], f"{when}, ['{key}']")
        return
    expect(space.contains(observation), f"{when}: the observation {observation!r} is not in {space}.")
