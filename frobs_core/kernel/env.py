"""The Gymnasium class for a single environment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import GoalTask, Snapshot
from frobs_core.kernel.compose import compose
from frobs_core.kernel.config import RENDER_MODES, EnvConfig
from frobs_core.kernel.copying import CopiedByArguments
from frobs_core.kernel.inputs import invalid_action
from frobs_core.kernel.loop import Loop
from frobs_core.util.arrays import Action
from frobs_core.util.errors import ResetNeededError


class RobotEnv(CopiedByArguments, gym.Env[Any, Any]):
    """Gymnasium environment in which robots perform a task.

    At every step, ``info`` contains ``is_success`` (0.0 or 1.0), the reward terms (``frobs/reward/<term>``), and the
    metrics of the controller (``frobs/…``). If the engine fails, ``info`` contains ``frobs/diverged``, and the episode
    is truncated. A paced simulator adds ``frobs/missed_deadlines``, the number of missed deadlines since the reset, and
    ``frobs/lateness``, the total delay of the actions [s].

    Args:
        keywords: Fields of :class:`frobs_core.kernel.config.EnvConfig`. All other keywords are passed to the task.

    Attributes:
        config: The keywords.
        control: All controllers.
        robot: Handle of the first controlled robot.
        controller: Controller of the first controlled robot's first joint group.
        observations: Observation terms, with their columns and units.
        step_context: Data about the latest step, for use by the task.
        after_reset: Functions to call after each reset; see :class:`frobs_core.kernel.loop.Loop`.
        after_step: Functions to call after each step.
        randomization: The randomization with its current values, or None if nothing is randomized.

    Raises:
        UnknownNameError: A requested name is not provided by any plugin.
        UnknownParameterError: The task, a controller or the simulator does not accept one of the keywords.
        CapabilityError: The simulator does not support a capability that the task, a controller, the randomization or
            an observation term requires.
        ConfigurationError: A value is invalid.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES)}  # noqa: RUF012 - declared as in Gymnasium

    def __init__(self, **keywords: Any) -> None:
        self.config = config = EnvConfig.from_dict(keywords)
        parts = compose(config, 1)
        self._loop = Loop(parts, 1)
        self.step_context = parts.context
        self.after_reset, self.after_step = self._loop.after_reset, self._loop.after_step
        self.simulation, self.control, self.task = parts.simulation, parts.control, parts.task
        self.robot, self.controller = parts.robot, parts.controller
        self.randomization = parts.randomization
        self.control_timestep, self.decimation = parts.control_timestep, parts.decimation
        self.action_space = parts.control.action_space
        self._action_shape = self.action_space.shape
        self.observations = parts.observations
        self.observation_space = parts.observations.space
        self.render_mode = config.render_mode
        self.metadata = {"render_modes": list(RENDER_MODES), "render_fps": round(1.0 / parts.control_timestep)}
        self._seeded = self._running = False
        self._checked = self._check_discrete if self._loop.discrete else self._check_box
        self._row = _rows_of if isinstance(self.observation_space, gym.spaces.Dict) else _row_of
        if isinstance(parts.task, GoalTask):
            self.compute_reward = parts.task.compute_reward  # hindsight experience replay calls this method

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Seed for all subsequent random numbers, or None to continue the current random sequence.
            options: Values for the task's ``reset_options``, for example ``{"goal": [0.4, 0.0, 0.3]}``.

        Returns:
            observation, info

        Raises:
            UnknownParameterError: The task does not accept one of the options.
            ConfigurationError: An option is invalid.
        """
        batched = self._loop.batch_options(options)
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self._loop.rng.seed([self.np_random_seed])
            self._seeded = True
        observation = self._loop.begin(None, batched)
        self._running = True
        if self.render_mode == "human":
            self.simulation.open_viewer()
        info = {}
        if self.randomization is not None:
            info["frobs/randomization"] = {name: values[0] for name, values in self.randomization.values.items()}
        return self._row(observation), info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one control step.

        Args:
            action: Action in the action space. Actions outside the bounds of a Box space are clipped.

        Returns:
            Tuple of observation, reward, terminated, truncated and info.

        Raises:
            InvalidActionError: The action has the wrong shape or is not finite.
            ResetNeededError: No episode is running.
        """
        if not self._running:
            raise ResetNeededError("no episode is running; call reset() first.")
        # An invalid action raises an error before any state changes, including the random state.
        observation, rewards, ends, failures, info = self._loop.step(self._checked(action))
        for name, values in info.items():
            info[name] = values.item()
        info["is_success"] = float(info["is_success"])
        reward: float = rewards.item()
        terminated = ends is not None and ends.item()
        diverged = failures is not None
        if diverged:
            info["frobs/diverged"] = True
            reward = 0.0
        if terminated or diverged:
            self._running = False
        return self._row(observation), reward, terminated, diverged, info

    def _check_box(self, action: Any) -> Action:
        try:
            array = np.asarray(action, np.float64)
        except (TypeError, ValueError, OverflowError):
            raise invalid_action(action, self.action_space) from None
        if array.shape != self._action_shape or not array.dot(array) < math.inf:  # a single number for all elements
            raise invalid_action(action, self.action_space)
        return array[None]

    def _check_discrete(self, action: Any) -> Action:
        if not self.action_space.contains(action):
            raise invalid_action(action, self.action_space)
        return np.asarray(action, np.int64)[None]

    def read_terms(self, settings: Mapping[str, Any]) -> dict[str, np.ndarray[Any, Any]]:
        """Read observation terms outside the observation.

        Args:
            settings: The terms by name, as in the keyword ``observations``. They are bound when they are first read,
                and read faster afterwards.

        Returns:
            The value of each term in a new array, with the shape and dtype that it has in an observation.

        Raises:
            ConfigurationError: A setting is invalid.
            UnknownNameError: A robot, body, contact, sensor or camera does not exist.
            CapabilityError: The simulator does not support a capability that a term requires.
        """
        return {name: values[0] for name, values in self._loop.read_terms(settings).items()}

    def render(self) -> Any:
        """Return an image, (height, width, 3) uint8, if ``render_mode`` is ``"rgb_array"``, otherwise None."""
        if self.render_mode != "rgb_array":
            return None
        config = self.config
        return self.simulation.render(None, config.camera, config.render_size, "rgb", self.task.markers())[0]

    def snapshot(self) -> Snapshot:
        """Return the complete state of the environment, without the state of its wrappers."""
        return {**self._loop.snapshot(), "running": np.array([self._running])}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._loop.restore(snapshot)
        self._running, self._seeded = bool(snapshot["running"][0]), True

    def close(self) -> None:
        """Release the simulation. Repeated calls have no effect."""
        self._running = False
        self.simulation.close()


def _row_of(observation: Any) -> Any:
    return observation[0]


def _rows_of(observation: Any) -> Any:
    return {key: values[0] for key, values in observation.items()}
