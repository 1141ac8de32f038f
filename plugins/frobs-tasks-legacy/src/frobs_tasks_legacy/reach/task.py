"""FRobs_RL's reaching task, with its observation, reward, termination and task YAML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import ConfigurationError, MissingSettingError, ParameterValueError
from frobs_core.interfaces import Controller, Simulation, Snapshot, StepContext
from frobs_core.observation import ObservationTerm
from frobs_core.random import RandomSource
from frobs_core.validation import non_negative
from frobs_tasks_legacy.reach.config import FILES
from frobs_tasks_reach import JointSampler, Oscillation, Reach, checked_goal, distance


class ReachLegacy(Reach):
    """FRobs_RL's reachers controlled by joint positions, for comparison with FRobs_RL and for porting from it.

    An action covers the whole range of each joint. FRobs_RL executed it as a motion and waited for the motion to end,
    so the IDs use the controller ``joint_delta_position`` with ``full_range=True`` and a control timestep of 0.5 s, in
    which the drives reach any commanded position unless an obstacle stops them. Differences from FRobs_RL: motions have
    no planned path and no speed limit, goals come from the forward kinematics of random joint vectors instead of points
    that a planner accepts, and the arm can collide.

    Observation, (dof + 6) float32: unit vector from the tool to the goal, zero if the distance is zero (NaN in
    FRobs_RL); goal [m]; joint positions [rad].

    Reward: ``reached_goal_reward`` if the tool is within the tolerance, else ``−multiplier_dist_reward`` · distance
    + ``step_reward``; additionally ``joint_limits_reward`` if a joint is within 1e-4 rad of a limit or beyond it.

    An episode terminates when the goal is reached, unless the goal moves (``pos_dynamic``).

    Args:
        profile: Source of the default values: ``"irb120"``, ``"irb140"``, ``"irb140_velocity"`` or ``"ur5"``. If None,
            ``"irb120"``, or ``"irb140_velocity"`` for control by joint velocities.
        config_file: FRobs_RL's unchanged task YAML for that reacher, with the arm's name as the root key. Missing keys,
            or all keys if None, use FRobs_RL's own values, which are in ``reach/tasks/`` of this package. The following
            arguments are named like the file's keys, and take precedence.
        min_joint_pos: Minimum joint positions, one for each joint [rad].
        max_joint_pos: Maximum joint positions, one for each joint [rad].
        position_goal_min: Minimum corner of the goal box in the world [m].
        position_goal_max: Maximum corner of the goal box in the world [m].
        tolerance_goal_pos: Distance that counts as reached [m].
        training: Whether goals are drawn at random; otherwise pass them as ``reset(options={"goal": …})``.
        pos_dynamic: Whether the goal moves: it oscillates along each axis about its drawn position.
        pos_dynamic_params: ``x_max_amplitude``, … [m] and ``x_max_freq``, … [Hz] of the motion.
        step_reward: Reward for each step that does not reach the goal.
        multiplier_dist_reward: Penalty per meter of distance [1/m].
        reached_goal_reward: Reward for a step that reaches the goal.
        joint_limits_reward: Reward for a step that ends at a joint limit.
        limit_margin: Maximum distance at which a joint counts as at its limit [rad]. If None, 1e-4, or 0.09 for control
            by joint velocities.
        limits: Limits for ``joint_limits_reward``. ``"reachable"``: the narrower of the robot's and the
            configuration's. ``"configured"``: ``min_joint_pos`` and ``max_joint_pos`` unchanged.
        goals: ``"reachable"``: tool positions of random joint positions, inside the goal box. ``"box"``: uniform in the
            goal box, whether or not they are reachable.
        initial: Joint positions at reset: ``"home"``, or ``"random"`` inside the limits.

    Raises:
        ConfigFileError: The file has an unknown key or an invalid value.
        ConfigurationError: A value is out of range.
        UnknownNameError: The profile does not exist.
    """

    reward_types: ClassVar[Sequence[str]] = ("dense",)
    success_rule: ClassVar[str] = "the tool comes within tolerance_goal_pos of the goal, which terminates the episode"
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "reached_goal": "reached_goal_reward where the goal is reached, else 0",
        "distance": "−multiplier_dist_reward · d unless the goal is reached; d is the distance from tool to goal",
        "step": "step_reward where the goal is not reached",
        "joint_limits": "joint_limits_reward where a joint is at one of its limits",
    }
    control_timestep: ClassVar[float] = 0.5
    usual_profile: ClassVar[str] = "irb120"
    _sees_from_shoulder: ClassVar[bool] = False
    usual_limit_margin: ClassVar[float] = 1e-4  # [rad] distance at which a joint counts as at its limit, as in FRobs_RL

    def __init__(
        self,
        *,
        profile: str | None = None,
        config_file: str | Path | None = None,
        min_joint_pos: Sequence[float] | None = None,
        max_joint_pos: Sequence[float] | None = None,
        position_goal_min: Sequence[float] | None = None,
        position_goal_max: Sequence[float] | None = None,
        tolerance_goal_pos: float | None = None,
        training: bool | None = None,
        pos_dynamic: bool | None = None,
        pos_dynamic_params: Mapping[str, float] | None = None,
        step_reward: float | None = None,
        multiplier_dist_reward: float | None = None,
        reached_goal_reward: float | None = None,
        joint_limits_reward: float | None = None,
        limit_margin: float | None = None,
        limits: str = "reachable",
        goals: str = "reachable",
        initial: str = "home",
    ) -> None:
        self.config = FILES.read(self.usual_profile if profile is None else profile, config_file, locals())
        super().__init__(
            tolerance=self.config["tolerance_goal_pos"],
            goal_low=self.config["position_goal_min"],
            goal_high=self.config["position_goal_max"],
            initial=initial,
        )
        self.limit_margin = (
            self.usual_limit_margin if limit_margin is None else non_negative("limit_margin", limit_margin)
        )
        if limits not in ("reachable", "configured"):
            raise ParameterValueError("limits", limits, "'reachable' or 'configured'")
        if goals not in ("reachable", "box"):
            raise ParameterValueError("goals", goals, "'reachable' or 'box'")
        self.limits, self.goals = limits, goals

    def bind(self, simulation: Simulation, controller: Controller, control_timestep: float) -> None:
        """Prepare for a simulation.

        Raises:
            ConfigurationError: The robot cannot reach any part of the goal box, or the configured joint positions do
                not match its joints.
        """
        params = self.config["pos_dynamic_params"]
        self._motion = Oscillation(
            simulation.num_envs,
            np.array([params[f"{axis}_max_amplitude"] for axis in "xyz"]),
            np.array([params[f"{axis}_max_freq"] for axis in "xyz"]),
            max_phase=0.0,
        )
        super().bind(simulation, controller, control_timestep)
        self._watched = self._sampler.lower, self._sampler.upper
        if self.limits == "configured":
            self._watched = np.array(self.config["min_joint_pos"]), np.array(self.config["max_joint_pos"])

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the direction to the goal, the goal, and the joint positions.

        A motion over the whole range in one step can hit the floor so hard that a light joint briefly exceeds its
        limit; its position is then clipped to the bound of the observation space.
        """
        known, ones = super().observation_terms(), np.ones(3)
        direction = ObservationTerm(read=lambda: unit_direction(self._offset), low=-ones, high=ones, unit="1")
        return {
            "goal_direction": _clipped(direction),
            "goal": _clipped(known["goal"]),
            "joint_positions": _clipped(known["joint_positions"]),
        }

    def reward(self, context: StepContext) -> Floats:
        """Return the reward, (num_envs,)."""
        config, outside = self.config, ~self.is_success()
        limited = at_limits(self._robot.joint_positions, *self._watched, self.limit_margin)
        self._reward_terms = {
            "reached_goal": ~outside * config["reached_goal_reward"],
            "distance": outside * self._distance * -config["multiplier_dist_reward"],
            "step": outside * config["step_reward"],
            "joint_limits": limited * config["joint_limits_reward"],
        }
        return sum(self._reward_terms.values(), np.zeros(len(outside)))

    def is_terminated(self) -> Mask | None:
        """Return which tools have reached the goal, (num_envs,) bool, or None if the goal moves."""
        return None if self.config["pos_dynamic"] else self.is_success()

    def snapshot(self) -> Snapshot:
        """Return the measured state and the goal's motion."""
        return {**super().snapshot(), **self._motion.snapshot()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._motion.restore(snapshot)
        super().restore(snapshot)

    def _make_sampler(self) -> JointSampler:
        dof = self._robot.dof
        for key in ("min_joint_pos", "max_joint_pos"):
            if len(self.config[key]) != dof:
                raise ParameterValueError(
                    key,
                    self.config[key],
                    f"{dof} numbers, one for each joint of robot '{self._robot.robot.name}': "
                    f"{', '.join(self._robot.joint_names)}",
                )
        sampler = JointSampler(
            self._robot, np.array(self.config["min_joint_pos"]), np.array(self.config["max_joint_pos"])
        )
        if not (sampler.lower < sampler.upper).all():
            raise ConfigurationError(
                f"min_joint_pos must be below max_joint_pos within the limits of robot '{self._robot.robot.name}'; "
                f"the remaining range is {sampler.lower} to {sampler.upper}."
            )
        return sampler

    def _draw_goals(self, mask: Mask | None, rng: RandomSource) -> Floats:
        if self.goals == "box":
            return rng.uniform("goal", self.goal_low, self.goal_high, (3,), mask)
        return super()._draw_goals(mask, rng)

    def _goal_excursion(self) -> float:
        params = self.config["pos_dynamic_params"]
        return max(params[f"{axis}_max_amplitude"] for axis in "xyz") if self.config["pos_dynamic"] else 0.0

    def _place_goal(self, rows: slice | Mask, mask: Mask | None, rng: RandomSource, given: Floats | None) -> None:
        if given is None and not self.config["training"]:
            raise MissingSettingError(
                "a task with training = false", "a goal", 'pass one with reset(options={"goal": (x, y, z)})'
            )
        centre = self._draw_goals(mask, rng) if given is None else checked_goal(given[rows], *self._goal_bounds())
        self._goal[rows] = centre
        self._motion.begin(mask, rng, centre=centre, start=None)

    def _measure(self) -> None:
        if self.config["pos_dynamic"]:
            self._goal[...] = self._motion.at(self._simulation.time)[0]
        super()._measure()


def _clipped(term: ObservationTerm) -> ObservationTerm:
    return replace(term, read=lambda: np.clip(term.read(), term.low, term.high))


def at_limits(joint_positions: Floats, lower: Floats, upper: Floats, margin: float) -> Mask:
    """Return whether any joint is at or beyond one of its limits.

    Args:
        joint_positions: (..., dof) [rad or m]
        lower: Broadcasts to (..., dof) [rad or m].
        upper: Broadcasts to (..., dof) [rad or m].
        margin: Maximum distance that counts as at the limit [rad or m].

    Returns:
        (...) bool.
    """
    near = (joint_positions <= lower + margin) | (joint_positions >= upper - margin)
    return np.asarray(near.any(axis=-1))


def unit_direction(offset: Floats) -> Floats:
    """Return vectors scaled to length 1; the zero vector stays zero.

    Args:
        offset: (..., 3) [m]

    Returns:
        (..., 3), each component in [−1, 1].
    """
    length = distance(offset)[..., None]
    return offset / np.where(length == 0.0, 1.0, length)
