"""The interface for tasks. A task is written once for batches of environments, independently of the physics engine."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from contextvars import ContextVar, copy_context
from dataclasses import dataclass
from functools import cached_property, reduce, wraps
from inspect import signature
from operator import add
from typing import Any, ClassVar, TypedDict

import numpy as np

from frobs_core.contracts.control import Control
from frobs_core.contracts.simulation import Simulation
from frobs_core.contracts.stateful import Stateful
from frobs_core.contracts.step_context import StepContext
from frobs_core.deprecation import warn_deprecated
from frobs_core.description import ObservationTerm
from frobs_core.description.reward_term import Rewards, reward_meanings, with_rewards
from frobs_core.description.scene import Marker, Scene
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.random import RandomSource


class ResetOptions(TypedDict, total=False):
    """Options that ``reset(options=…)`` accepts. A task may accept more."""

    goal: Floats
    joint_positions: Floats


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """Settings that fit a task to an arm. Settings of the user take precedence.

    Attributes:
        task: Keywords of the task.
        controller: Keywords of the controller of the arm's first joint group. ``ControllerDefaults`` apply only to the
            controller that they name.
        home: Home positions by joint name [rad or m].
    """

    task: Mapping[str, Any]
    controller: Mapping[str, Any]
    home: Mapping[str, float]


class Task(Stateful, ABC):
    """Base class of tasks.

    The constructor validates and stores keyword-only parameters, which users pass to the environment. ``bind`` is
    called once, after the simulation is built.

    During a control step, the environment calls ``advance``, reads the observation terms, and calls ``reward``,
    ``is_terminated`` and ``is_success``, in this order. During a reset, the environment calls ``reset`` and reads the
    observation terms.

    Do not multiply (num_envs, k) arrays by a matrix (``@``, ``dot``), and do not compute statistics across
    environments. Such operations would make the results of a vector environment differ from those of single
    environments.

    Rewards are data: a class that defines ``rewards`` needs neither ``reward`` nor ``reward_terms``, ``reward_types`` or
    ``reward_meanings``. If its docstring has a line ``{rewards}``, the formulas of all terms are inserted there.

    Attributes:
        rewards: Terms of each reward type, by reward type and name. The first reward type is the default.
        reward_types: Valid values of ``reward_type``, the first of which is the default.
        reset_options: Keys of ``options`` that ``reset`` accepts.
        robots: Names of the robots that the task needs. If one is missing, the environment raises
            MissingSettingError before it builds the simulator.
        fitting: ``"module:function"`` of the function that fits the task to an arm that is passed as a model file, or empty
            if the task takes robots as they are. The gripper of the arm is found in the file. The function receives the
            task's class, the arm's :class:`~frobs_core.description.Robot` and its model, and returns :class:`Fitted`.
        replacing: Parameters that replace others: by name, the parameters that a user cannot set together with it.
        control_timestep: Default time between two actions [s].
        physics_timestep: Default duration of one physics step [s].
        success_rule: Success condition of an episode, as one sentence without a period, for listings and documentation
            pages.
        instruction: One imperative sentence that tells a person or a language-conditioned policy what to do, such as
            ``"Pick up the cube and bring it to the goal."``. Recorded episodes store it.
        reward_meanings: Description of each reward term, by name, for listings and documentation pages.
        late_terms: Observation terms that are constant until the agent makes progress. For example, if all episodes
            start with the same waypoint, the term that contains the current waypoint changes only after the agent has
            reached it. Because the conformance kit takes random actions, it does not expect these terms to vary.
        expert: ``"module:class"`` of the task's :class:`~frobs_core.contracts.Expert`, or empty if the task has no
            expert.
        reward_type: The selected reward type, set before ``bind``.
    """

    rewards: ClassVar[Rewards] = {}
    reward_types: ClassVar[Sequence[str]] = ("dense",)
    reset_options: ClassVar[Sequence[str]] = ()
    robots: ClassVar[Sequence[str]] = ()
    fitting: ClassVar[str] = ""
    replacing: ClassVar[Mapping[str, Sequence[str]]] = {}
    control_timestep: ClassVar[float] = 0.04
    physics_timestep: ClassVar[float] = 0.002
    success_rule: ClassVar[str] = ""
    instruction: ClassVar[str] = ""
    reward_meanings: ClassVar[Mapping[str, str]] = {}
    late_terms: ClassVar[Sequence[str]] = ()
    expert: ClassVar[str] = ""

    reward_type: str
    _reward_terms: Mapping[str, Floats] = {}

    def scene(self) -> Scene:
        """Return everything in the simulation except the controlled robots."""
        return Scene()

    def reset_needs(self, options: Collection[str] = ()) -> Mapping[str, Level]:
        """Return the simulator capabilities that a reset requires, in addition to those in the task's record.

        A task that starts with the robot at home requires no capabilities. A task that places the robot elsewhere
        requires ``teleport``. The environment calls this method without options before it builds the simulator, and
        with the given options in each ``reset``.

        Args:
            options: Names of the options passed to ``reset``.

        Returns:
            Minimum level of each capability, by name.
        """
        return {}

    @abstractmethod
    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Prepare for a simulation: store its handles and allocate buffers.

        Args:
            simulation: The simulation.
            control: All controllers. ``control.robot("robot")`` returns the handle of a controlled robot.
            control_timestep: Time between two actions [s].
        """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Derive what ``rewards`` implies, and let the ``bind`` of a subclass work with that of tasks of version 0.2."""
        super().__init_subclass__(**kwargs)
        own = vars(cls)
        if "rewards" in own:
            cls.reward_types = own.get("reward_types", tuple(cls.rewards))
            cls.reward_meanings = own.get("reward_meanings", reward_meanings(cls.rewards))
        cls.__doc__ = own.get("__doc__") and with_rewards(own["__doc__"], cls.rewards)
        if "bind" in vars(cls):
            cls.bind = _accepting_controller(cls.bind)  # type: ignore[method-assign]

    @abstractmethod
    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Begin an episode after the simulation has been reset, for example by placing the robot and sampling a goal.

        Args:
            mask: The environments to reset.
            rng: The only source of random numbers that the task may use.
            options: The given options whose keys are in ``reset_options``, as (num_envs, …) arrays. Only the rows
                selected by ``mask`` are valid.
        """

    def advance(self, context: StepContext) -> None:
        """Update quantities that several terms use. Called once per control step, after the simulation has stepped."""

    @abstractmethod
    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms by name, in order. Called once, after :meth:`bind`.

        The names are used to configure noise and delays. The environment reads terms after ``advance`` and after
        ``reset``. Reading a term must not change any state.
        """

    def reward(self, context: StepContext) -> Floats:
        """Return the reward of the step that has just ended, (num_envs,): the weighted sum of the terms in ``rewards``."""
        self._reward_terms = {name: weight * function(self) for name, weight, function in self._weighted_terms}
        return reduce(add, self._reward_terms.values())

    @cached_property
    def _weighted_terms(self) -> Sequence[tuple[str, Floats, Callable[[Any], Floats]]]:
        # The weights are arrays, because NumPy takes three times as long to multiply an array by a Python float.
        terms = self.rewards[self.reward_type].items()
        return [(name, np.array(term.weight_in(self)), term.function) for name, term in terms]

    def reward_terms(self) -> Mapping[str, Floats]:
        """Return the terms that add up to the last reward, (num_envs,) each, for logs."""
        return self._reward_terms

    def is_terminated(self) -> Mask | None:
        """Return which environments are in a terminal state, (num_envs,) bool, or None if episodes never terminate."""
        return None

    @abstractmethod
    def is_success(self) -> Mask:
        """Return which environments currently satisfy the success condition, (num_envs,) bool."""

    def set_goal(self, position: Floats, mask: Mask | None = None) -> None:
        """Move the goals during an episode, for example because a person drags them. Tasks with such a goal override it.

        The next control step measures the distance to the new goals.

        Args:
            position: New goals in the world frame, (n, 3) [m]. Tasks whose goals are on the floor ignore z.
            mask: The n environments to change, (num_envs,) bool, or None for all.

        Raises:
            ConfigurationError: The task has no goal that can be moved, or a goal is out of range.
        """
        raise ConfigurationError(f"the task {type(self).__name__} has no goal that can be moved during an episode.")

    def markers(self) -> Sequence[Marker]:
        """Return markers to render in addition to the scene."""
        return ()


_CONTROL: ContextVar[Control] = ContextVar("_CONTROL")  # of the environment whose task of version 0.2 is bound


def _accepting_controller(bind: Callable[..., None]) -> Callable[..., None]:
    """Return a ``bind`` that works with the ``bind`` of version 0.2, which has the parameter ``controller``.

    A task of version 0.2 gets the first controller, and passes it on to the ``bind`` of its base class or of its parts.
    """
    takes_controller = "controller" in signature(bind).parameters

    @wraps(bind)
    def accepting(
        task: Task,
        simulation: Simulation,
        control: Any = None,
        control_timestep: float = 0.0,
        *,
        controller: Any = None,
    ) -> None:
        control = controller if control is None else control
        if not takes_controller and not isinstance(control, Control):
            control = _CONTROL.get(control)
        if not takes_controller or not isinstance(control, Control):
            bind(task, simulation, control, control_timestep)
            return
        what = f"the parameter 'controller' of {type(task).__qualname__}.bind"
        instead = "bind(self, simulation, control, control_timestep) and control.robot('robot')"
        warn_deprecated(what, instead=instead, since="0.3", removed_in="0.4")
        context = copy_context()
        context.run(_CONTROL.set, control)
        context.run(bind, task, simulation, next(iter(control.controllers.values())), control_timestep)

    return accepting
