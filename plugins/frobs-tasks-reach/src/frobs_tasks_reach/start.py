"""Base class for reaching tasks: selects the robot's initial posture and a reachable goal."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.contracts import RobotHandle, Task
from frobs_core.models import JointType, joint_path, longest_reach
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError, UnsuitableRobotError
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import number_list, numbers
from frobs_tasks_reach.keep_out import Foot
from frobs_tasks_reach.reset_options import checked_goal, checked_joint_positions
from frobs_tasks_reach.sampling import JointSampler, box_of, in_box

_FLOOR_CLEARANCE = 0.05  # [m] minimum height of the tool at the start of an episode, to keep the arm above the floor
_FOOT_CLEARANCE = 0.03  # [m] minimum distance between a goal and the robot's base: half the width of a flange
_SURVEY = 4096  # number of joint vectors used to check, before any goal is drawn, that the goal box is reachable


class EpisodeStart(Task):
    """Base class for reaching tasks: places the robot and the goal at the start of an episode.

    Args:
        goal_low: Minimum corner of the goal box in the world frame [m], or None to derive the corner from the tool's
            reach.
        goal_high: Maximum corner of the goal box in the world frame [m], or None to derive the corner from the tool's
            reach.
        initial: Joint positions at reset: ``"home"``, or ``"random"`` for random positions. If part of the arm would be
            below the floor at home, the nearest posture above the floor is used instead. As in FRobs_RL, random
            positions are uniformly distributed within the limits, with the tool at least 5 cm above the floor. Random
            initial positions make the task harder to learn.

    Raises:
        ConfigurationError: A value is out of range.
    """

    goal_low: Floats
    goal_high: Floats
    _goal: Floats

    def __init__(
        self,
        *,
        goal_low: Sequence[float] | None = None,
        goal_high: Sequence[float] | None = None,
        initial: str = "home",
    ) -> None:
        self._given_low = None if goal_low is None else np.array(number_list("goal_low", goal_low, 3))
        self._given_high = None if goal_high is None else np.array(number_list("goal_high", goal_high, 3))
        if self._given_low is not None and self._given_high is not None:
            self._set_box(self._given_low, self._given_high)
        if initial not in ("home", "random"):
            raise ParameterValueError("initial", initial, "'home' or 'random'")
        self.initial = initial
        self._start: Floats | None = None  # start posture (dof,), or None to start at home

    def reset_needs(self, options: Collection[str] = ()) -> Mapping[str, Level]:
        """Return the capability ``teleport`` if episodes do not start at the robot's home position."""
        from_home = self.initial == "home" and self._start is None and "joint_positions" not in options
        return {} if from_home else {"teleport": Level.APPROXIMATE}

    def _bind_start(self, robot: RobotHandle) -> None:
        """Bind the task to a robot, and determine the goal box and the start posture."""
        self._robot = robot
        self._foot = Foot(robot)
        self._sampler = self._make_sampler()
        self._choose_box()
        self._start = self._sampler.start() if self.initial == "home" else None

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Place the robot and the goal.

        Args:
            mask: The environments to reset.
            rng: Random source. The streams ``"joint_positions"`` and ``"goal"`` are used.
            options: Optional ``joint_positions``, (num_envs, dof) [rad or m], and ``goal``, (num_envs, 3) [m] in the
                world frame.

        Raises:
            ConfigurationError: A joint position is outside the joint's limits, or a goal is out of reach.
        """
        rows = rows_of(mask)
        self._place_robot(rows, mask, rng, options.get("joint_positions"))
        self._place_goal(rows, mask, rng, options.get("goal"))
        self._measure()

    # -- Methods that derived tasks override --

    def _measure(self) -> None:
        """Measure the state that the observation and the reward use."""
        raise NotImplementedError

    def _make_sampler(self) -> JointSampler:
        return JointSampler(self._robot)

    def _draw_goals(self, mask: Mask | None, rng: RandomSource) -> Floats:
        """Draw goals (n, 3) [m] for the environments selected by the mask."""
        return self._sampler.draw("goal", rng, mask, self._is_in_box, self._box_text)[1]

    def _place_goal(self, rows: slice | Mask, mask: Mask | None, rng: RandomSource, given: Floats | None) -> None:
        self._goal[rows] = (
            self._draw_goals(mask, rng) if given is None else checked_goal(given[rows], *self._goal_bounds())
        )

    def _goal_excursion(self) -> float:
        """Return the maximum distance that a goal may move along an axis from its initial position [m]."""
        return 0.0

    # -- Helpers --

    def _place_robot(self, rows: slice | Mask, mask: Mask | None, rng: RandomSource, given: Floats | None) -> None:
        robot = self._robot
        if given is not None:
            robot.write_joint_state(checked_joint_positions(given[rows], self._robot), mask=mask)
        elif self.initial == "random":
            what = f"initial joint positions with the tool at least {_FLOOR_CLEARANCE} m above the floor"
            robot.write_joint_state(
                self._sampler.draw("joint_positions", rng, mask, _is_above_floor, what)[0], mask=mask
            )
        elif self._start is not None:
            robot.write_joint_state(np.tile(self._start, (len(self._goal[rows]), 1)), mask=mask)
        # otherwise, the simulation's reset has already moved the robot to home

    def _is_in_box(self, positions: Floats) -> Mask:
        return in_box(positions, self.goal_low, self.goal_high) & self._foot.is_clear(positions, _FOOT_CLEARANCE)

    def _set_box(self, low: Floats, high: Floats) -> None:
        self.goal_low, self.goal_high = box("goal_low", low, "goal_high", high)
        self._box_text = f"goal box {numbers(self.goal_low)} to {numbers(self.goal_high)} m"

    def _choose_box(self) -> None:
        """Derive unspecified corners of the goal box from the arm's reach, and check that the arm can reach the box."""
        reached = self._sampler.survey(_SURVEY)
        if self._given_low is None or self._given_high is None:
            low, high = box_of(reached)
            self._set_box(
                low if self._given_low is None else self._given_low,
                high if self._given_high is None else self._given_high,
            )
        if self._is_in_box(reached).any():
            return
        raise UnsuitableRobotError(
            self._robot.robot.name,
            f"cannot reach any part of the {self._box_text}: its tool "
            f"'{self._robot.tcp}' moves between {numbers(reached.min(axis=0))} and {numbers(reached.max(axis=0))} m "
            f"({_SURVEY} random joint vectors were tried); choose goal_low and goal_high inside this range.",
        )

    def _reach_box(self) -> tuple[Floats, Floats]:
        """Return the corners (3,) [m] of a box that the tool never leaves.

        The corners are infinite if the tool is moved by a sliding joint or the base is not fixed.
        """
        path = joint_path(self._robot.model, self._robot.frame_name("tcp"))
        if self._robot.robot.base != "fixed" or any(joint.type is JointType.PRISMATIC for joint in path):
            return np.full(3, -np.inf), np.full(3, np.inf)
        reach = 1.01 * longest_reach(self._robot.model, self._robot.frame_name("tcp"))
        base = self._robot.base_pose[0][0]
        return base - reach, base + reach

    def _goal_bounds(self) -> tuple[Floats, Floats]:
        """Return the corners (3,) [m] of a box around all possible goals: the goal box and all reachable positions."""
        low, high = self._reach_box()
        return np.minimum(self.goal_low, low), np.maximum(self.goal_high, high)


def _is_above_floor(positions: Floats) -> Mask:
    return positions[..., 2] >= _FLOOR_CLEARANCE


def box(low_name: str, low: Any, high_name: str, high: Any) -> tuple[Floats, Floats]:
    """Return the corners of a box, (3,) [m] each, of which the first is below the second on every axis."""
    lowest, highest = np.array(number_list(low_name, low, 3)), np.array(number_list(high_name, high, 3))
    if not (lowest < highest).all():
        raise ParameterValueError(
            low_name, tuple(lowest.tolist()), f"below {high_name} {numbers(highest)} on every axis"
        )
    return lowest, highest
