"""Reaching task with a moving goal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Control, Simulation, Snapshot
from frobs_core.description import ObservationTerm, Rewards
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import positive
from frobs_tasks_reach.motion import Oscillation
from frobs_tasks_reach.reach import Reach
from frobs_tasks_reach.reset_options import checked_goal
from frobs_tasks_reach.workspace import Workspace

_SURVEY = 1 << 17  # number of joint vectors used to determine the reachable cells of the goal box


class ReachDynamic(Reach):
    """Task of keeping the tool center point at a moving goal.

    The goal oscillates along each axis: center + amplitude · sin(2π · frequency · t + phase). The parameters of this
    motion are drawn at the start of each episode. The center is the tool position for a random joint vector within the
    limits, chosen such that motions of maximum amplitude along every axis stay in the goal box and within the arm's
    reach (according to a 5 cm grid). If a goal is passed in the options of ``reset``, the motion starts at this goal.

    Episodes never terminate. An episode is successful if the tool is within the tolerance of the goal at the time
    limit. The reward depends on the distance d from the tool to the goal at the end of the control step:

    {rewards}

    The observation also contains the goal's velocity.

    Args:
        max_amplitude: Upper limit of the goal's amplitudes [m], which are drawn uniformly from [0, ``max_amplitude``).
        max_frequency: Upper limit of the goal's frequencies [Hz], which are drawn uniformly from [0,
            ``max_frequency``). At 0.2 Hz and the default amplitude, the goal moves at up to 0.13 m/s along each axis.
            In FRobs_RL, the goal hardly moved, because its frequency was at most 0.01 Hz.
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_reach.reach.Reach`.

    Raises:
        ConfigurationError: A value is out of range.
    """

    instruction: ClassVar[str] = "Keep the tool at the moving goal."
    rewards: ClassVar[Rewards] = {
        "dense": {
            "tracking_error": Reach.rewards["dense"]["distance"],
            "precision": Reach.rewards["dense"]["precision"],
        },
        "sparse": Reach.rewards["sparse"],
    }

    def __init__(self, *, max_amplitude: float = 0.1, max_frequency: float = 0.2, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.max_amplitude = positive("max_amplitude", max_amplitude)
        self.max_frequency = positive("max_frequency", max_frequency)

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Bind the task to a simulation.

        Raises:
            ConfigurationError: The robot has no joints, or the goal box does not leave enough room for the goal's
                motion.
        """
        self._motion = Oscillation(simulation.num_envs, np.full(3, self.max_amplitude), np.full(3, self.max_frequency))
        super().bind(simulation, control, control_timestep)
        self._goal_velocity = np.zeros_like(self._goal)
        reached = self._sampler.survey(_SURVEY)
        self._workspace = Workspace(self.goal_low, self.goal_high, reached[self._is_in_box(reached)])
        self._workspace.shrink(self.max_amplitude)
        if self._workspace.is_empty:
            raise ConfigurationError(
                f"the {self._box_text} has too little reachable space for a goal that oscillates by "
                f"{self.max_amplitude} m; choose a smaller max_amplitude or a larger box."
            )

    @property
    def tracking_error(self) -> Floats:
        """Current distance from the tool to the goal, (num_envs,) [m]."""
        return self.distance

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms of ``Reach`` and a term for the goal's velocity."""
        speed = self._motion.max_speed
        velocity = ObservationTerm(read=lambda: self._goal_velocity, low=-speed, high=speed, unit="m/s", scale=5.0)
        return {**super().observation_terms(), "goal_velocity": velocity}

    def stored_arrays(self) -> Snapshot:
        """Return the measured state and the goal's motion."""
        return {**super().stored_arrays(), **self._motion.stored_arrays()}

    def _goal_excursion(self) -> float:
        return 2.0 * self.max_amplitude  # a user-specified goal may be at either end of the motion

    def _place_goal(self, rows: slice | Mask, mask: Mask | None, rng: RandomSource, given: Floats | None) -> None:
        start = None if given is None else checked_goal(given[rows], *self._goal_bounds())
        centre = self._draw_goals(mask, rng) if given is None else None
        self._motion.begin(mask, rng, centre=centre, start=start)

    def _draw_goals(self, mask: Mask | None, rng: RandomSource) -> Floats:
        return self._sampler.draw("goal", rng, mask, self._workspace.contains, self._box_text)[1]

    def _measure(self) -> None:
        self._goal[...], self._goal_velocity[...] = self._motion.at(self._simulation.time)
        super()._measure()
