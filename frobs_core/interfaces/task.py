"""A task: meaning. Written once, batched, against the words of the interfaces; it never sees the engine."""

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
    """What ``reset(options=…)`` understands; a task may understand more."""

    goal: Floats
    joint_positions: Floats


class Task(ABC):
    """Base class of tasks.

    A constructor takes keyword-only parameters, which are the keywords that users may give to the
    environment; it validates and stores. ``bind`` is called once, when the simulation stands.

    In a control step the environment calls ``advance``, reads the observation terms, and calls ``reward``,
    ``is_terminated`` and ``is_success``, in this order. In a reset it calls ``reset`` and reads the terms.

    No product of (num_envs, k) with a matrix (``@``, ``dot``) and no statistic over the environments: both
    break the law that environment *i* of a vector equals the single environment.

    Attributes:
        reward_types: What ``reward_type`` may be; the first is the default.
        reset_options: Keys of ``options`` that ``reset`` understands.
        control_timestep: [s] default between two actions.
        physics_timestep: [s] default of one engine step.
        success_rule: When an episode is a success, in one sentence without a full stop; for lists and pages.
        reward_meanings: What each of :meth:`reward_terms` is, by name; for lists and pages.
        late_terms: Terms of the observation that change only once something is achieved, as a way-point of which the
            first is always the same; the kit, which acts at random, does not expect them to vary.
        expert: ``"module:class"`` of its :class:`~frobs_core.interfaces.Expert`; empty: it has none.
        reward_type: The one in force; set before ``bind``.
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
        """Return everything that is not the robot."""
        return Scene()

    def reset_needs(self, options: Collection[str] = ()) -> Mapping[str, Level]:
        """Return what a reset needs of the simulator, beside the needs of the task's record.

        A task that starts from home needs nothing, and one that places the robot elsewhere needs ``teleport``. The
        environment asks before it builds the simulator, without options, and in each call of its ``reset``.

        Args:
            options: Names of the options that the caller of ``reset`` gave.

        Returns:
            Lowest level of each ability, by its name.
        """
        return {}

    @abstractmethod
    def bind(self, simulation: Simulation, controller: Controller, control_timestep: float) -> None:
        """Prepare for a simulation: keep the handles, make buffers."""

    @abstractmethod
    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Begin an episode: the simulation has been reset; place the robot, draw a goal.

        Args:
            mask: The environments.
            rng: Draw from nothing else.
            options: Those of ``reset_options`` that the caller gave, as (num_envs, …) arrays of which the rows of
                the mask count.
        """

    def advance(self, context: StepContext) -> None:
        """Bring up to date what the terms share, once per control step, after the simulation has stepped."""

    @abstractmethod
    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return what is observed, by name, in order; called once, after :meth:`bind`.

        Names are used to give noise or a delay to a term. A term is read after ``advance`` and after ``reset``; reading it
        must change nothing.
        """

    @abstractmethod
    def reward(self, context: StepContext) -> Floats:
        """Return the reward of the step that has just ended, (num_envs,)."""

    def reward_terms(self) -> Mapping[str, Floats]:
        """Return the terms whose sum the last reward was, (num_envs,) each, for logs."""
        return {}

    def is_terminated(self) -> Mask | None:
        """Return which episodes end here with no value beyond, (num_envs,) bool; None: none, ever."""
        return None

    @abstractmethod
    def is_success(self) -> Mask:
        """Return where the goal is reached now, (num_envs,) bool."""

    def markers(self) -> Sequence[Marker]:
        """Return what pictures should show beside the scene."""
        return ()

    def snapshot(self) -> Snapshot:
        """Return what the task keeps between steps beside the simulation."""
        return {}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""


class GoalTask(Task):
    """A goal-conditioned task: two of its terms have the keys ``"achieved_goal"`` and ``"desired_goal"``."""

    @abstractmethod
    def compute_reward(self, achieved_goal: Floats, desired_goal: Floats, info: Any) -> Floats:
        """Return the reward for goals, with no regard to the state.

        Args:
            achieved_goal: (..., k)
            desired_goal: (..., k)
            info: Ignored.

        Returns:
            (...): equal to :meth:`reward` where the goals are those of the step.
        """
