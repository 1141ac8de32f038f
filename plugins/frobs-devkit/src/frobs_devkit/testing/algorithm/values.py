"""Checks that the discount and the final observations of episodes affect training."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_devkit.testing.algorithm.subject import AlgorithmUnderTest, Monitor
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, after, expect
from frobs_devkit.testing.compare import difference

_DISCOUNT = "gamma"
_OTHER = 0.5  # a discount that no algorithm uses by default
_EPISODE = 10  # [steps]


class _OtherEnds(gym.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """A vector wrapper that negates the final observations of episodes and counts truncated episodes."""

    ends = 0

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step the environments, and negate the final observations in the info."""
        observation, reward, terminated, truncated, info = self.env.step(actions)
        if "final_obs" in info:
            self.ends += int(truncated.sum())
            changed = [None if final is None else -np.asarray(final) for final in info["final_obs"]]
            finals = np.empty(len(changed), object)
            finals[:] = changed
            info = {**info, "final_obs": finals}
        return observation, reward, terminated, truncated, info


@after("same_seed_repeats")
def discount_counts(subject: AlgorithmUnderTest) -> None:
    """Training with a different discount ``gamma`` gives a different result."""
    _require_discount(subject)
    other = replace(subject, config={**subject.config, _DISCOUNT: _OTHER})
    expect(
        _differs(subject, subject.trained, other.trained),
        f"training with {_DISCOUNT}={_OTHER} gives the same result as with {_DISCOUNT}="
        f"{_settings(subject)[_DISCOUNT]}; the setting has no effect.",
    )


@after("same_seed_repeats")
def final_observations_count(subject: AlgorithmUnderTest) -> None:
    """Truncated episodes bootstrap from the final observation, not from the first observation of the next episode.

    With same-step autoreset, ``info["final_obs"]`` contains the final observation, and ``step`` returns the first
    observation of the next episode.
    """
    _require_discount(subject)
    told = []
    ends = 0
    for wrapper in (None, _OtherEnds):
        with closing(subject.make_env(_EPISODE)) as env:
            if wrapper is not None:
                env.env = wrapper(env.env)
            algorithm, monitor = subject.make(env), Monitor(env)
            algorithm.train(subject.steps, monitor)
            ends = getattr(env.env, "ends", 0)
        told.append((algorithm, monitor))
    if not ends:
        raise Inconclusive(f"no episode was truncated in {subject.steps} steps")
    expect(
        _differs(subject, *told),
        f"{ends} episodes were truncated, but changing their final observations does not affect training; bootstrap "
        "from info['final_obs'], because step() returns the first observation of the next episode.",
    )


def _settings(subject: AlgorithmUnderTest) -> Mapping[str, Any]:
    resolved: Mapping[str, Any] = subject.record.load().resolve_config(subject.config)
    return resolved


def _require_discount(subject: AlgorithmUnderTest) -> None:
    if _DISCOUNT not in _settings(subject):
        raise NotApplicable(f"the algorithm has no setting '{_DISCOUNT}'")


def _differs(subject: AlgorithmUnderTest, one: tuple[Any, Monitor], other: tuple[Any, Monitor]) -> bool:
    """Return whether two training runs differ in their predictions or in their reported metrics."""
    seen = subject.observations(8)
    learned = [algorithm.predict(seen)[0] for algorithm, _ in (one, other)]
    return one[1].rows != other[1].rows or difference(*learned) is not None
