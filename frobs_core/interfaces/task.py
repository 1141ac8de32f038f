"""The interface of tasks. A task is written once, for batches of environments, and does not access the engine."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar, TypedDict

from frobs_core.arrays import Floats, Mask
from frobs_core.capabilities import Level
from frobs_core.interfaces.controller import Controller
from frobs_core.interfaces.scene import Marker, Scene
from frobs_core.interfaces.simulation import Simulation, Snapshot
from frobs_core.interfaces.step_context import StepContext
from frobs_core.observation import ObservationTerm
from frobs_core.random import RandomSource


class ResetOptions(TypedDict, total=False):
    """Options that ``reset(options=…)`` accepts. A task may accept more."""

    goal: Floats
    joint_positions: Floats


class Task(ABC):
    """Base class of tasks.

    The constructor takes keyword-only parameters, which users set as keywords of the environment; it validates and
    stores them. ``bind`` is called once, after the simulation is built.

    In a control step the environment calls ``advance``, reads the observation terms, and calls ``reward``,
    ``is_terminated`` and ``is_success``, in this order. In a reset it calls ``reset`` and reads the terms.

    Do not use products of (num_envs, k) with a matrix (``@``, ``dot``) or statistics over the environments. With them,
    environment *i* of a vector would no longer equal the single environment.

    Attributes:
        reward_types: Valid values of ``reward_type``; the first is the default.
        reset_options: Keys of ``options`` that ``reset`` accepts.
        control_timestep: Default time between two actions [s].
        physics_timestep: Default duration of one physics step [s].
        success_rule: Condition for the success of an episode, in one sentence without a full stop; for lists and pages.
        reward_meanings: Description of each of :meth:`reward_terms`, by name; for lists and pages.
        late_terms: Observation terms that are constant until the agent achieves something, such as a waypoint of which
            the first is always the same. The conformance kit acts at random and does not expect these terms to vary.
        expert: ``"module:class"`` of its :class:`~frobs_core.interfaces.Expert`; empty: it has none.
        reward_type: The selected reward type; set before ``bind``.
    """

    reward_types: ClassVar[Sequence[str]] = ("dense",)
    reset_options: ClassVar[Sequence[str]] = ("joint_positions",)
    control_timestep: ClassVar[float] = 0.04
    physics_timestep: ClassVar[float] = 0.002
    success_rule: ClassVar[str] = ""
    reward_meanings: ClassVar[Mapping[str, str]] = {}
    late_terms: ClassVar[Sequence[str]] = ()
    expert: ClassVar[str] = ""

    reward_type: str

    def scene(self) -> Scene:
        """Return everything except the robot."""
        return Scene()

    def reset_needs(self, options: Collection[str] = ()) -> Mapping[str, Level]:
        """Return the abilities of the simulator that a reset requires, in addition to the needs of the task's record.

        A task that starts at home needs none; a task that places the robot elsewhere needs ``teleport``. The
        environment calls this without options before it builds the simulator, and in each ``reset``.

        Args:
            options: Names of the options passed to ``reset``.

        Returns:
            Minimum level of each ability, by name.
        """
        return {}

    @abstractmethod
    def bind(self, simulation: Simulation, controller: Controller, control_timestep: float) -> None:
        """Prepare for a simulation: store the handles, allocate buffers."""

    @abstractmethod
    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Begin an episode after the simulation has been reset: place the robot, sample a goal.

        Args:
            mask: The environments.
            rng: The only random source to use.
            options: The passed options among ``reset_options``, as (num_envs, …) arrays. Only the rows of the mask are
                valid.
        """

    def advance(self, context: StepContext) -> None:
        """Update quantities that several terms use. Called once per control step, after the simulation has stepped."""

    @abstractmethod
    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms by name, in order. Called once, after :meth:`bind`.

        The names are used to configure noise and delays. A term is read after ``advance`` and after ``reset``; reading
        it must not change anything.
        """

    @abstractmethod
    def reward(self, context: StepContext) -> Floats:
        """Return the reward of the step that has just ended, (num_envs,)."""

    def reward_terms(self) -> Mapping[str, Floats]:
        """Return the terms that add up to the last reward, (num_envs,) each, for logs."""
        return {}

    def is_terminated(self) -> Mask | None:
        """Return which episodes end in this state, with no value beyond, (num_envs,) bool; None means never."""
        return None

    @abstractmethod
    def is_success(self) -> Mask:
        """Return in which environments the goal is currently reached, (num_envs,) bool."""

    def markers(self) -> Sequence[Marker]:
        """Return markers to render in addition to the scene."""
        return ()

    def snapshot(self) -> Snapshot:
        """Return the state that the task keeps between steps, in addition to that of the simulation."""
        return {}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""


class GoalTask(Task):
    """A goal-conditioned task. Two of its terms have the keys ``"achieved_goal"`` and ``"desired_goal"``."""

    @abstractmethod
    def compute_reward(self, achieved_goal: Floats, desired_goal: Floats, info: Any) -> Floats:
        """Return the reward for given goals, independent of the current state.

        Args:
            achieved_goal: (..., k)
            desired_goal: (..., k)
            info: Ignored.

        Returns:
            (...): equal to :meth:`reward` for the goals of the step.
        """
