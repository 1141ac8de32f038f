"""FRobs_RL's reaching task, with its observation, reward, termination and task YAML files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np

from frobs_core.contracts import Control, Simulation, Snapshot
from frobs_core.description import ObservationTerm, Rewards, RewardTerm
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError, MissingSettingError, ParameterValueError
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import non_negative
from frobs_tasks_legacy.clipping import clipped
from frobs_tasks_legacy.reach.config import FILES
from frobs_tasks_reach import JointSampler, Oscillation, Reach, checked_goal, distance


class ReachLegacy(Reach):
    """FRobs_RL's reaching task with joint position control, for comparisons and for porting FRobs_RL projects.

    Actions cover the whole range of each joint. FRobs_RL executed each action as a complete motion and waited until the
    motion ended. Therefore, the registered environments use the controller ``joint_delta_position`` with
    ``full_range=True`` and a control timestep of 0.5 s (1 s for the UR5), in which the drives reach any commanded
    position unless an obstacle stops them. In contrast to FRobs_RL, motions have neither a planned path nor a speed
    limit, and the arm can collide with obstacles. Goals are tool positions at random joint positions, whereas FRobs_RL
    used random points to which MoveIt could plan a motion.

    The observation, (dof + 6) float32, consists of the unit vector from the tool to the goal, the goal [m], and the
    joint positions [rad]. If the distance is zero, the unit vector is zero (FRobs_RL returned NaN).

    The reward depends on the distance d from the tool to the goal:

    {rewards}

    A joint is at a limit within 1e-4 rad of the limit or beyond it.

    An episode terminates when the tool reaches the goal, unless ``pos_dynamic`` is true and the goal therefore moves.

    Args:
        profile: Name of the original task that provides the default values: ``"irb120"``, ``"irb140"``,
            ``"irb140_velocity"`` or ``"ur5"``. If None, ``"irb120"`` is used, or ``"irb140_velocity"`` with joint
            velocity control.
        config_file: Task YAML file of FRobs_RL, with the arm's name as the root key, or None to use only FRobs_RL's
            original values. FRobs_RL's files work without changes. Values that are not in the file are taken from
            FRobs_RL's original files, which are in this package's folder ``reach/tasks/``. Arguments with the same name
            as a key, such as ``min_joint_pos``, take precedence over the file.
        min_joint_pos: Minimum joint positions, one for each joint [rad].
        max_joint_pos: Maximum joint positions, one for each joint [rad].
        position_goal_min: Minimum corner of the goal box in the world frame [m].
        position_goal_max: Maximum corner of the goal box in the world frame [m].
        tolerance_goal_pos: Distance within which the goal is considered reached [m].
        training: Whether goals are random. If False, pass goals with ``reset(options={"goal": …})``.
        pos_dynamic: Whether the goal oscillates along each axis about its initial position.
        pos_dynamic_params: Maximum amplitudes ``x_max_amplitude``, … [m] and frequencies ``x_max_freq``, … [Hz] of the
            goal's oscillation.
        step_reward: Reward for each step that does not reach the goal.
        multiplier_dist_reward: Penalty per meter of distance to the goal [1/m].
        reached_goal_reward: Reward for a step that reaches the goal.
        joint_limits_reward: Reward for each step that ends with a joint at its limit.
        limit_margin: Distance from a limit within which a joint is considered to be at the limit [rad]. If None, 1e-4
            is used, or 0.09 with joint velocity control.
        limits: Joint limits to which ``joint_limits_reward`` refers. With ``"reachable"``, the narrower of the robot's
            and the configured limits apply. With ``"configured"``, only ``min_joint_pos`` and ``max_joint_pos`` apply.
        goals: Distribution of goals in the goal box: ``"reachable"`` for tool positions at random joint positions, or
            ``"box"`` for uniformly distributed goals, which may be out of reach.
        initial: Joint positions at reset: ``"home"``, or ``"random"`` for random positions within the limits.

    Raises:
        ConfigFileError: The file contains an unknown key or an invalid value.
        ConfigurationError: A value is out of range.
        UnknownNameError: The profile does not exist.
    """

    success_rule: ClassVar[str] = "the tool comes within tolerance_goal_pos of the goal, which terminates the episode"
    rewards: ClassVar[Rewards] = {
        "dense": {
            "reached_goal": RewardTerm(
                function=lambda task: task.is_success(),
                weight="reached_goal_reward",
                meaning="1 if d ≤ tolerance_goal_pos",
            ),
            "distance": RewardTerm(
                function=lambda task: ~task.is_success() * task.distance,
                weight="-multiplier_dist_reward",
                meaning="d unless the goal is reached",
                unit="m",
            ),
            "step": RewardTerm(
                function=lambda task: ~task.is_success(),
                weight="step_reward",
                meaning="1 unless the goal is reached",
            ),
            "joint_limits": RewardTerm(
                function=lambda task: task.is_at_limit(),
                weight="joint_limits_reward",
                meaning="1 if a joint is at one of its limits",
            ),
        }
    }
    control_timestep: ClassVar[float] = 0.5
    usual_profile: ClassVar[str] = "irb120"
    _sees_from_shoulder: ClassVar[bool] = False
    usual_limit_margin: ClassVar[float] = 1e-4  # [rad] same margin as in FRobs_RL

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
        for name in ("step_reward", "multiplier_dist_reward", "reached_goal_reward", "joint_limits_reward"):
            setattr(self, name, self.config[name])

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Bind the task to a simulation.

        Raises:
            ConfigurationError: The robot cannot reach any part of the goal box, or the configured joint positions do
                not match the robot's joints.
        """
        params = self.config["pos_dynamic_params"]
        self._motion = Oscillation(
            simulation.num_envs,
            np.array([params[f"{axis}_max_amplitude"] for axis in "xyz"]),
            np.array([params[f"{axis}_max_freq"] for axis in "xyz"]),
            max_phase=0.0,
        )
        super().bind(simulation, control, control_timestep)
        self._watched = self._sampler.lower, self._sampler.upper
        if self.limits == "configured":
            self._watched = np.array(self.config["min_joint_pos"]), np.array(self.config["max_joint_pos"])

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for the direction to the goal, the goal, and the joint positions.

        If an action moves a joint across its whole range, the arm can hit the floor so hard that a light joint briefly
        exceeds its limit. The observed joint position is then clipped to the bound of the observation space.
        """
        known, ones = super().observation_terms(), np.ones(3)
        direction = ObservationTerm(read=lambda: unit_direction(self._offset), low=-ones, high=ones, unit="1")
        return {
            "goal_direction": clipped(direction),
            "goal": clipped(known["goal"]),
            "joint_positions": clipped(known["joint_positions"]),
        }

    def is_at_limit(self) -> Mask:
        """Return whether a joint of each robot is at one of its limits, (num_envs,) bool."""
        return at_limits(self._robot.joint_positions, *self._watched, self.limit_margin)

    def is_terminated(self) -> Mask | None:
        """Return whether each tool has reached its goal, (num_envs,) bool, or None if the goals move."""
        return None if self.config["pos_dynamic"] else self.is_success()

    def stored_arrays(self) -> Snapshot:
        """Return the measured state and the goal's motion."""
        return {**super().stored_arrays(), **self._motion.stored_arrays()}

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
                "min_joint_pos and max_joint_pos leave at least one joint no range of motion within the limits of "
                f"robot '{self._robot.robot.name}'; the remaining ranges are {sampler.lower} to {sampler.upper}."
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
                "a task with training = false", "a goal", 'pass a goal with reset(options={"goal": (x, y, z)})'
            )
        centre = self._draw_goals(mask, rng) if given is None else checked_goal(given[rows], *self._goal_bounds())
        self._goal[rows] = centre
        self._motion.begin(mask, rng, centre=centre, start=None)

    def _measure(self) -> None:
        if self.config["pos_dynamic"]:
            self._goal[...] = self._motion.at(self._simulation.time)[0]
        super()._measure()


def at_limits(joint_positions: Floats, lower: Floats, upper: Floats, margin: float) -> Mask:
    """Return whether any joint is at or beyond one of its limits.

    Args:
        joint_positions: Joint positions, (..., dof) [rad or m].
        lower: Lower limits, broadcastable to (..., dof) [rad or m].
        upper: Upper limits, broadcastable to (..., dof) [rad or m].
        margin: Distance from a limit within which a joint is considered to be at the limit [rad or m].

    Returns:
        (...) bool.
    """
    near = (joint_positions <= lower + margin) | (joint_positions >= upper - margin)
    return np.asarray(near.any(axis=-1))


def unit_direction(offset: Floats) -> Floats:
    """Scale vectors to length 1. A zero vector remains zero.

    Args:
        offset: Vectors, (..., 3) [m].

    Returns:
        The scaled vectors, (..., 3), with components in [−1, 1].
    """
    length = distance(offset)[..., None]
    return offset / np.where(length == 0.0, 1.0, length)
