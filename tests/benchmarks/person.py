"""Policy that acts like a person, and its plugin: the task's expert, with pauses and with motions that overshoot.

``imitation.py`` installs this module as a plugin, so that ``frobs record ID --policy person`` finds the policy. It works
in manipulation tasks, whose action begins with the motion of the tool along three axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.contracts import Policy
from frobs_core.contracts.policy import Environment
from frobs_core.description import Observation
from frobs_core.kernel.policies import TaskExpert
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import PolicyRecord
from frobs_core.util.arrays import Floats, Mask

AXES = slice(0, 3)
"""Columns of the action that move the tool."""
PAUSE, LONGEST_PAUSE = 0.03, 12
"""Probability that a pause begins at a step, and maximum length of a pause [control steps]."""
INERTIA, EAGERNESS = 0.75, 1.5
"""Share of the previous motion that continues at each step, and factor of the expert's motion. Together, they make the
tool overshoot: the expert's next actions correct it."""
TREMOR = 0.3
"""Standard deviation of the noise that is added to the motion, as a fraction of the motion."""


class Person(Policy):
    """The scripted expert of the environment's task, with the imperfections of a person.

    Args:
        seed: Seed of the pauses and of the noise, ≥ 0.
    """

    def __init__(self, seed: int = 0) -> None:
        self._seed, self._expert = seed, TaskExpert()

    def bind(self, env: Environment) -> None:
        """Bind the expert, and allocate one row of memory per environment."""
        self._expert.bind(env)
        self._rng = np.random.default_rng(self._seed)
        num_envs: int = getattr(env, "num_envs", 1)
        self._motion: Floats = np.zeros((num_envs, 3))
        self._pause = np.zeros(num_envs, np.int64)  # remaining steps of the pause

    def act(self, observation: Observation, episode_start: Mask) -> Floats:
        """Return the actions of a person in the current states, (num_envs, action size)."""
        action: Floats = np.array(self._expert.act(observation, episode_start))
        self._motion[episode_start], self._pause[episode_start] = 0.0, 0
        num_envs = len(action)
        begins = (self._pause == 0) & (self._rng.random(num_envs) < PAUSE)
        lengths = self._rng.integers(1, LONGEST_PAUSE + 1, num_envs)
        self._pause = np.where(begins, lengths, np.maximum(self._pause - 1, 0))
        wanted = np.where(self._pause[:, None] > 0, 0.0, EAGERNESS * action[:, AXES])
        self._motion = INERTIA * self._motion + (1.0 - INERTIA) * wanted
        noise = TREMOR * self._rng.standard_normal((num_envs, 3))
        moving = np.abs(self._motion).max(axis=1, keepdims=True)  # a hand that rests does not tremble
        action[:, AXES] = np.clip(self._motion + moving * noise, -1.0, 1.0)
        return action

    def info(self) -> dict[str, np.ndarray[Any, Any]]:
        """Return the facts of the expert."""
        return dict(self._expert.info())


@hookimpl
def frobs_extensions() -> list[PolicyRecord]:
    """Offer the policy."""
    summary = "the task's scripted expert, with the pauses and corrections of a person"
    return [PolicyRecord(name="person", summary=summary, entry_point="person:Person")]
