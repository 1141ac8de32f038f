"""What the single and the vector environment share: the parts, and the beginning of an episode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Mask
from frobs_core.compose import Parts
from frobs_core.errors import ConfigurationError, InvalidActionError, UnknownParameterError
from frobs_core.interfaces import Controller, Snapshot
from frobs_core.interfaces.task import Observation
from frobs_core.random import RandomSource

RENDER_MODES = ("rgb_array", "human")


class Loop:
    """The parts of an environment and its source of random numbers.

    Args:
        parts: Bound to each other.
        num_envs: ≥ 1.
    """

    def __init__(self, parts: Parts, num_envs: int) -> None:
        self.simulation = parts.simulation
        self.robot = parts.robot
        self.controller = parts.controller
        self.task = parts.task
        self.control_timestep = parts.control_timestep
        self.decimation = parts.decimation
        self.num_envs = num_envs
        self.rng = RandomSource(num_envs)
        self.randomization = parts.randomization
        self.discrete = not isinstance(parts.controller.action_space, gym.spaces.Box)
        self.term_keys: dict[str, str] = {}
        told = parts.controller.info
        self.controller_tells = getattr(told, "__func__", None) is not Controller.info

    def begin(self, mask: Mask | None, options: Mapping[str, Any]) -> Observation:
        """Begin an episode where ``mask`` says, and observe all environments."""
        self.rng.begin_episode(mask)
        if self.randomization is not None:
            self.randomization.begin_physics(self.rng, mask)
        self.simulation.reset(mask)
        self.task.reset(mask, self.rng, options)
        self.controller.reset(mask)
        observation = self.task.observe(self.rng)
        return observation if self.randomization is None else self.randomization.begin(self.rng, observation, mask)

    def options(self, options: Mapping[str, Any] | None) -> dict[str, Any]:
        """Check what ``reset`` was given, and spread it over the environments."""
        if not options:
            return {}
        spread = {}
        for name, value in options.items():
            if name not in self.task.reset_options:
                raise UnknownParameterError("reset(options=…)", name, self.task.reset_options)
            array = np.asarray(value, np.float64)
            if not np.isfinite(array).all():
                raise ConfigurationError(f"reset option '{name}' holds a number that is not finite: {value}.")
            if array.ndim < 2:
                array = np.broadcast_to(array, (self.num_envs, *array.shape))
            elif len(array) != self.num_envs:
                raise ConfigurationError(
                    f"reset option '{name}' has {len(array)} rows for {self.num_envs} environments."
                )
            spread[name] = array
        return spread

    def key(self, term: str) -> str:
        """Return the ``info`` key of a reward term."""
        if term not in self.term_keys:
            self.term_keys[term] = f"frobs/reward/{term}"
        return self.term_keys[term]

    def fail_action(self, action: Any, space: gym.Space[Any]) -> None:
        """Raise the error that says what is wrong with an action."""
        given = np.asarray(action)
        if given.shape != space.shape:
            raise InvalidActionError(f"the action has shape {given.shape}; the action space has {space.shape}.")
        where = np.argwhere(~np.isfinite(given)).tolist()
        if where:
            raise InvalidActionError(f"the action is not finite at {where[:3]}: {given[tuple(where[0])]}.")
        raise InvalidActionError(f"the action {action!r} is not in {space}.")

    def render(self, mask: Mask | None, camera: str | None, size: tuple[int, int]) -> np.ndarray[Any, Any]:
        """Draw environments, with what the task marks."""
        return self.simulation.render(mask, camera, size, "rgb", self.task.markers())

    def snapshot(self) -> Snapshot:
        """Return the complete state of all parts."""
        parts = {
            "simulation": self.simulation.snapshot(),
            "task": self.task.snapshot(),
            "controller": self.controller.snapshot(),
            "random": self.rng.snapshot(),
            "randomization": {} if self.randomization is None else self.randomization.snapshot(),
        }
        return {f"{part}/{name}": array for part, state in parts.items() for name, array in state.items()}

    def restore(self, snapshot: Snapshot) -> None:
        """Return all parts to a snapshot."""
        parts = ("simulation", "task", "controller", "random", "randomization")
        split: dict[str, dict[str, Any]] = {part: {} for part in parts}
        for name, array in snapshot.items():
            part, _, rest = name.partition("/")
            if part in split:
                split[part][rest] = array
        self.simulation.restore(split["simulation"])
        self.task.restore(split["task"])
        self.controller.restore(split["controller"])
        self.rng.restore(split["random"])
        if self.randomization is not None:
            self.randomization.restore(split["randomization"])


def check_render_mode(render_mode: str | None) -> None:
    """Refuse a render mode that there is not.

    Raises:
        ConfigurationError: It is none of ``RENDER_MODES``.
    """
    if render_mode is not None and render_mode not in RENDER_MODES:
        raise ConfigurationError(f"render_mode '{render_mode}' is none of {', '.join(RENDER_MODES)}.")
