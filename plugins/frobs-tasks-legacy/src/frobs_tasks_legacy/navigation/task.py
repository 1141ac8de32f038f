"""FRobs_RL's navigation task, including its observations, rewards, termination condition and task YAML files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Control, Simulation
from frobs_core.description import ObservationTerm, Rewards, RewardTerm
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ParameterValueError
from frobs_tasks_legacy.clipping import clipped
from frobs_tasks_legacy.navigation.config import FILES, WEIGHTS
from frobs_tasks_navigation import Navigate

_OBSERVED = {
    "maze": ("distance", "bearing", "position", "yaw", "way_point", "lidar"),
    "dynamic": ("distance", "bearing", "lidar"),
    "empty": ("distance", "bearing"),
}


class NavigateLegacy(Navigate):
    """FRobs_RL's navigation task for the Kobuki, for comparisons with FRobs_RL and for porting FRobs_RL projects.

    A step always lasts 0.2 s. In FRobs_RL, the duration of a step varied. The distance, bearing and waypoint position
    in an observation always refer to the same waypoint. In FRobs_RL, the observed distance and bearing switched to the
    next waypoint one step after the observed waypoint position did.

    The reward depends on the distance d and the bearing b [rad] of the waypoint:

    {rewards}

    The task requires a discount factor close to 1. With a factor of 0.99 per step, waiting in front of a waypoint costs
    less than driving to the next waypoint, so PPO does not learn to cross the maze. The tuned settings use 0.999.

    An episode terminates only at the last waypoint. Collisions and leaving the area do not end an episode.

    Args:
        world: Name of a world of FRobs_RL: ``"maze"``, ``"dynamic"`` or ``"empty"``.
        config_file: Task YAML file of FRobs_RL, with the root key ``kobuki_maze``, ``kobuki_dynamic`` or
            ``kobuki_empty``. FRobs_RL's files work without changes. Missing values are taken from FRobs_RL's original
            files, which are in this package's folder ``navigation/tasks/``. If ``config_file`` is None, all values are
            taken from these files. Arguments with the same name as a key, such as ``lidar_samples``, take precedence
            over the file.
        floor_plan: Walls, boxes, start poses and waypoints, as a YAML file or a mapping in the format of
            :class:`frobs_tasks_navigation.Navigate`, or None to use the floor plan of ``world``.
        lidar: Name of the robot's lidar.
        bumper: Name of the robot's bumper.
        lidar_samples: Required number of rays of the robot's lidar.
        tolerance_goal_pos: Distance within which a waypoint is considered reached [m].
        step_reward: Reward for each step.
        multiplier_dist_reward: Penalty per meter of distance to the waypoint [1/m].
        angle_diff_reward_multiplier: Penalty per radian between the direction to the waypoint and the robot's forward
            or backward direction, whichever is closer [1/rad].
        reached_midway_reward: Reward for a step that reaches a waypoint.
        not_reached_midway_reward: Reward per remaining waypoint for each step that does not reach a waypoint.
        reached_goal_reward: Reward for a step that reaches the goal, in worlds without routes.
        collision_reward: Reward for each step that ends too close to an obstacle.
        collision_distance_threshold: Lidar range below which an obstacle is too close [m].

    Raises:
        ConfigFileError: The file contains an unknown key or an invalid value.
        ConfigurationError: A value is out of range.
    """

    physics_timestep: ClassVar[float] = 0.01
    success_rule: ClassVar[str] = "the robot is within the tolerance of the last waypoint"
    rewards: ClassVar[Rewards] = {
        "dense": {
            "reached": RewardTerm(
                function=lambda task: task.reached_reward * task.last_step.reached,
                meaning="reached_midway_reward at a waypoint, or reached_goal_reward in worlds without routes",
            ),
            "distance": RewardTerm(
                function=lambda task: ~task.last_step.reached * task.last_step.distance,
                weight="-multiplier_dist_reward",
                meaning="d unless a waypoint is reached",
                unit="m",
            ),
            "bearing": RewardTerm(
                function=lambda task: ~task.last_step.reached * _angle_to_axis(task.last_step.bearing),
                weight="-angle_diff_reward_multiplier",
                meaning="min(|b|, π − |b|) unless a waypoint is reached",
                unit="rad",
            ),
            "way_points": RewardTerm(
                function=lambda task: ~task.last_step.reached * task.last_step.left,
                weight="not_reached_midway_reward",
                meaning="number of remaining waypoints unless a waypoint is reached",
            ),
            "step": RewardTerm(
                function=lambda task: np.ones(len(task.is_success())), weight="step_reward", meaning="1 at every step"
            ),
            "collision": RewardTerm(
                function=lambda task: task.is_too_near(),
                weight="collision_reward",
                meaning="1 if the lidar's smallest range is below collision_distance_threshold",
            ),
        }
    }
    area_ends: ClassVar[bool] = False

    def __init__(
        self,
        *,
        world: str = "maze",
        config_file: str | Path | None = None,
        floor_plan: str | Path | Mapping[str, Any] | None = None,
        lidar: str = "lidar",
        bumper: str = "bumper",
        lidar_samples: int | None = None,
        tolerance_goal_pos: float | None = None,
        step_reward: float | None = None,
        multiplier_dist_reward: float | None = None,
        angle_diff_reward_multiplier: float | None = None,
        reached_midway_reward: float | None = None,
        not_reached_midway_reward: float | None = None,
        reached_goal_reward: float | None = None,
        collision_reward: float | None = None,
        collision_distance_threshold: float | None = None,
    ) -> None:
        self.config = FILES.read(world, config_file, locals())
        super().__init__(
            floor_plan=world if floor_plan is None else floor_plan,
            tolerance=self.config["tolerance_goal_pos"],
            observation=_OBSERVED[world],
            lidar=lidar,
            bumper=bumper,
            collision_ends=False,
        )
        for name in WEIGHTS:
            setattr(self, name, self.config[name])
        self.reached_reward = self.config["reached_midway_reward" if self.plan.routes else "reached_goal_reward"]

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Bind the task to a simulation.

        Raises:
            ConfigurationError: The robot cannot drive, or its lidar does not have the configured number of rays.
        """
        super().bind(simulation, control, control_timestep)
        if "lidar" not in self._observed:
            return
        rays, samples = self._robot.robot.lidars[self.lidar].rays, self.config["lidar_samples"]
        if rays != samples:
            raise ParameterValueError(
                "lidar_samples",
                samples,
                f"{rays} to match the robot's lidar; alternatively, change the lidar with "
                f'sensors={{"{self.lidar}": {{"rays": {samples}}}}}',
            )

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms of the world, clipped to their bounds, because the robot may leave the area."""
        return {name: clipped(term) for name, term in super().observation_terms().items()}

    def is_too_near(self) -> Mask:
        """Return whether the lidar of each robot sees something too close, (num_envs,) bool."""
        if "lidar" not in self._observed:
            return np.zeros(len(self.is_success()), np.bool_)
        return np.asarray(self._sensors.read(self.lidar).min(axis=1) < self.config["collision_distance_threshold"])


def _angle_to_axis(bearing: Floats) -> Floats:
    """Return the angle between the direction to the waypoint and the robot's forward or backward direction [rad]."""
    ahead = np.abs(bearing)
    return np.minimum(ahead, np.pi - ahead)
