"""The control loop of any number of environments, and the Gymnasium class for a single environment."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from operator import call, itemgetter
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from frobs_core.contracts import Controller, GoalTask, Snapshot, Stateful, Task, Viewer
from frobs_core.description import Observation
from frobs_core.kernel.added_terms import AddedTerms
from frobs_core.kernel.compose import Parts, compose
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.copying import CopiedByArguments
from frobs_core.kernel.inputs import batch_options, check_actions, invalid_action
from frobs_core.kernel.viewers import PICTURE, Metadata, open_viewer, render_modes
from frobs_core.util.arrays import Action, Floats, Mask, widened
from frobs_core.util.errors import ResetNeededError

StepResult: TypeAlias = tuple[Observation, Floats, Mask | None, Mask | None, dict[str, Any]]
"""Result of a control step: observation, (num_envs, …); reward, (num_envs,); terminated episodes, (num_envs,) bool or
None; engine failures, (num_envs,) bool or None; and info values by name, (num_envs,) each. Everything except the
observation is valid only until the next step.
"""


class Loop(Stateful):
    """Control loop that runs the steps and episodes of ``num_envs`` environments.

    A single environment is a batch of size 1.

    Args:
        parts: Connected parts of the environment.
        num_envs: ≥ 1.

    Attributes:
        context: Data about the latest step, for use by the task.
        rng: Source of all random numbers.
        after_reset: Functions that are called in this order after each reset and before the first observation, with the
            mask of the reset environments, or None for all. They may replace the initial state with a snapshot's. Tasks,
            controllers and sensors have already measured it, and do not notice other changes.
        after_step: Functions that are called with the result of each step, before any automatic reset. The rows of
            environments that wait for a next-step autoreset are not meaningful.
        before_autoreset: Functions that a vector environment calls before each automatic reset, when the simulation
            still has the last state, with the mask of the environments to reset, (num_envs,) bool.
        discrete: Whether the action space is not a Box.
    """

    def __init__(self, parts: Parts, num_envs: int) -> None:
        self.simulation, self.control, self.task = parts.simulation, parts.control, parts.task
        self.observations, self._checked_terms = parts.observations, False
        self.randomization = randomization = parts.randomization
        self.decimation, self.num_envs = parts.decimation, num_envs
        self.context, self.rng = parts.context, parts.context.rng
        self._check_reset, self._bind_terms = parts.check_reset, parts.bind_terms
        self.after_reset: list[Callable[[Mask | None], None]] = []
        self.after_step: list[Callable[[StepResult], None]] = []
        self.before_autoreset: list[Callable[[Mask], None]] = []
        self.discrete = not isinstance(parts.control.action_space, gym.spaces.Box)
        self._robots = [(name, robot.robot) for name, robot in parts.control.robots.items()]
        # The usual case: one command goes directly from a controller to its robot.
        self._only = parts.control.only if randomization is None else None
        self._reads = parts.observations.vector_reads or []
        self._observe = self._observe_vectors if self._reads else parts.observations.observe
        self.added_terms = parts.added_terms
        self._read_terms: dict[str, AddedTerms] = {}  # terms outside the observation, by their settings
        self._sampled = [parts.added_terms] if parts.added_terms.stateful else []
        self._physics_rate = parts.control.physics_rate
        self._can_terminate = _overrides(parts.task, Task, "is_terminated")
        # Parts whose info() is called at each step, and the prefix of their values in the environment's info.
        self._info_sources: list[tuple[Any, str]] = []
        if parts.simulation.pacer is not None:
            self._info_sources.append((parts.simulation.pacer, "frobs/"))
        controllers = parts.control.controllers
        for name, controller in controllers.items():
            if _overrides(controller, Controller, "info"):
                prefix = "frobs/" if len(controllers) == 1 else f"frobs/{name}/"
                self._info_sources.append((controller, prefix))

    def _observe_vectors(self) -> Observation:
        # Converted to float32 after concatenating, because np.concatenate with a dtype takes twice as long.
        return np.concatenate(list(map(call, self._reads)), axis=1).astype(np.float32)

    def batch_options(self, options: Mapping[str, Any] | None) -> Mapping[str, Floats]:
        """Validate the reset options, and repeat them for every environment, (num_envs, …) each.

        For the other errors, see :func:`.batch_options`.

        Raises:
            CapabilityError: The simulator does not support a capability that a reset with these options requires.
        """
        batched = batch_options(options, self.task.reset_options, self.num_envs)
        self._check_reset(batched)
        return batched

    def begin(self, mask: Mask | None, options: Mapping[str, Any]) -> Observation:
        """Begin an episode in the environments selected by ``mask``, and return the observation of all environments.

        Args:
            mask: Mask of the environments, or None for all environments.
            options: Reset options from :meth:`batch_options`.
        """
        self.rng.begin_episode(mask)
        if self.randomization is not None:
            self.randomization.begin_physics(self.rng, mask)
        self.simulation.reset(mask)
        self.task.reset(mask, self.rng, options)
        self.control.reset(mask)
        self.context.reset(mask)
        for terms in self._sampled:
            terms.reset(self.rng, mask)
        for callback in self.after_reset:
            callback(mask)
        if not self._checked_terms:  # checked only now, because terms may have no values before the first reset
            self.observations.check()
            self._checked_terms = True
        return self.observe(mask)

    def observe(self, begun: Mask | None) -> Observation:
        """Return the observation of all environments, in which episodes have ``begun``: a mask, or None for all."""
        observation = self._observe()
        return observation if self.randomization is None else self.randomization.begin(self.rng, observation, begun)

    def step(self, actions: Action) -> StepResult:
        """Advance by one control step.

        Args:
            actions: Validated actions, (num_envs, …).
        """
        context, rng, task = self.context, self.rng, self.task
        rng.clock += 1
        context.raw_action, context.previous_raw_action = context.previous_raw_action, context.raw_action
        context.raw_action[...] = actions
        if self._only is not None:
            commands = [self._only.apply(actions)]
        else:
            commands = self.control.commands(actions)
            if self.randomization is not None:
                commands = self.randomization.act(rng, commands)
        for (name, robot), command in zip(self._robots, commands, strict=True):
            robot.command(command)
            context.commands[name] = command if command.ndim == 2 else command[:, -1]
        if self._physics_rate:
            self.simulation.step_with(self.decimation, self.control.update)
            context.commands.update(self.control.last_commands)
        else:
            self.simulation.step(self.decimation)
        task.advance(context)  # computes the quantities that the task's methods below use
        for terms in self._sampled:
            terms.advance(rng)
        observation = self._observe()
        if self.randomization is not None:
            observation = self.randomization.observe(rng, observation)
        reward = task.reward(context)
        terminated = task.is_terminated() if self._can_terminate else None
        info: dict[str, Any] = {"is_success": task.is_success()}
        for name, values in task.reward_terms().items():
            info["frobs/reward/" + name] = values
        for part, prefix in self._info_sources:
            for name, values in part.info().items():
                info[prefix + name] = values
        result = observation, reward, terminated, self.simulation.diverged, info
        for callback in self.after_step:
            callback(result)
        return result

    def read_terms(self, settings: Mapping[str, Any]) -> dict[str, np.ndarray[Any, Any]]:
        """Read observation terms outside the observation, (num_envs, …) each.

        For the arguments and errors, see :meth:`.RobotEnv.read_terms`.
        """
        key = repr(settings)
        if key not in self._read_terms:
            terms = self._read_terms[key] = self._bind_terms(settings)
            if terms.stateful:
                # They draw after the terms of the observation, so that the numbers of the latter do not change.
                self._sampled.append(terms)
                terms.reset(self.rng, None)
        return {name: np.array(term.read(), term.dtype) for name, term in self._read_terms[key].terms.items()}

    def restore(self, snapshot: Snapshot) -> None:
        super().restore(snapshot)
        self._sample_again(None)

    def restore_rows(self, mask: Mask, snapshot: Snapshot, rows: npt.NDArray[np.int64]) -> None:
        """Restore the n environments of ``mask``, except their random streams, from ``rows`` (n,) of a snapshot."""
        for name, part in self.stored_parts().items():
            if part is self.rng:
                continue
            state = part.snapshot()
            for key, array in state.items():
                state[key] = _put_rows(array, mask, snapshot[f"{name}/{key}"][rows])
            part.restore(state)
        self._sample_again(mask)

    def _sample_again(self, mask: Mask | None) -> None:
        """Take the first samples of the terms outside the observation, whose state is not part of a snapshot."""
        for terms in self._read_terms.values():
            terms.reset(self.rng, mask)

    def stored_parts(self) -> dict[str, Any]:
        parts = {
            "simulation": self.simulation,
            "task": self.task,
            "controller": self.control,
            "context": self.context,
            "random": self.rng,
        }
        if self.added_terms.stateful:
            parts["terms"] = self.added_terms
        return parts if self.randomization is None else {**parts, "randomization": self.randomization}


def _put_rows(array: np.ndarray[Any, Any], mask: Mask, rows: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return a copy of an array (num_envs, …) in which the rows selected by ``mask`` are replaced."""
    shape = np.maximum(array.shape[1:], rows.shape[1:])
    changed = widened(array, shape)
    changed[mask] = widened(rows, shape)
    return changed


def _overrides(part: object, base: type, method: str) -> bool:
    """Return whether a part, or the part that it wraps, overrides a method that is empty in ``base``."""
    return getattr(part, method).__func__ is not getattr(base, method)


class ComposedEnv(CopiedByArguments):
    """What single and vector environments have in common: the attributes that :class:`RobotEnv` lists."""

    metadata = Metadata()

    viewer: Viewer | None

    def _compose(self, keywords: Mapping[str, Any], num_envs: int) -> Parts:
        self.config = config = EnvConfig.from_dict(keywords)
        parts = compose(config, num_envs)
        self._loop = Loop(parts, num_envs)
        self.step_context = parts.context
        self.after_reset, self.after_step = self._loop.after_reset, self._loop.after_step
        self.simulation, self.control, self.task = parts.simulation, parts.control, parts.task
        self.scene, self.robot, self.controller = parts.scene, parts.robot, parts.controller
        self.observations, self.randomization = parts.observations, parts.randomization
        self.control_timestep, self.decimation = parts.control_timestep, parts.decimation
        self.render_mode = config.render_mode
        self.metadata = {"render_modes": render_modes(), "render_fps": max(1, round(1.0 / parts.control_timestep))}
        self._seeded = False
        return parts

    def _pictures(self) -> np.ndarray[Any, Any] | None:
        if self.render_mode != PICTURE:
            return None
        config = self.config
        return self.simulation.render(None, config.camera, config.render_size, "rgb", self.task.markers())

    def _release(self) -> None:
        if self.viewer is not None:
            self.viewer.close()
        self.simulation.close()


class RobotEnv(ComposedEnv, gym.Env[Any, Any]):
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
        scene: Everything in the simulation except the controlled robots.
        viewer: Viewer that ``render_mode`` names, or None.
        observations: Observation terms, with their columns and units.
        step_context: Data about the latest step, for use by the task.
        after_reset: Functions to call after each reset; see :class:`frobs_core.kernel.env.Loop`.
        after_step: Functions to call after each step.
        randomization: The randomization with its current values, or None if nothing is randomized.

    Raises:
        UnknownNameError: A requested name is not provided by any plugin.
        UnknownParameterError: The task, a controller or the simulator does not accept one of the keywords.
        CapabilityError: The simulator does not support a capability that the task, a controller, the randomization or
            an observation term requires.
        ConfigurationError: A value is invalid.
    """

    def __init__(self, **keywords: Any) -> None:
        parts = self._compose(keywords, 1)
        self.action_space = parts.control.action_space
        self._action_shape = self.action_space.shape
        self.observation_space = parts.observations.space
        self._running = False
        self._checked = self._check_discrete if self._loop.discrete else self._check_box
        self._row = _rows_of if isinstance(self.observation_space, gym.spaces.Dict) else itemgetter(0)
        if isinstance(parts.task, GoalTask):
            self.compute_reward = parts.task.compute_reward  # hindsight experience replay calls this method
        self.viewer = open_viewer(self, self.render_mode)

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
        if self.viewer is not None:
            self.viewer.update()
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
        flat = array.ravel()
        if array.shape != self._action_shape or not flat.dot(flat) < math.inf:  # a single number for all elements
            raise invalid_action(action, self.action_space)
        return array[None]

    def _check_discrete(self, action: Any) -> Action:
        return check_actions(action, self.action_space)[None]

    def read_terms(self, settings: Mapping[str, Any]) -> dict[str, np.ndarray[Any, Any]]:
        """Read observation terms that need not be part of the observation.

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
        pictures = self._pictures()
        return None if pictures is None else pictures[0]

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
        self._release()


def _rows_of(observation: Any) -> Any:
    return {key: values[0] for key, values in observation.items()}
