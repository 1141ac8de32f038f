"""The task: a wheeled robot drives to a goal on the floor.

The task handles any number of environments at once: every array has one row per environment. Use only functions that
work row by row, not matrix products or means over the environments, because environments must not affect each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Control, Simulation, Snapshot, StepContext, Task
from frobs_core.description import Camera, Marker, ObservationTerm, Rewards, RewardTerm, Scene
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import quat_conjugate, quat_from_axis_angle, quat_rotate


def in_frame(quat_wxyz: Floats, vector: Floats) -> Floats:
    """Convert world-frame vectors (num_envs, 3) to a frame with the orientation ``quat_wxyz`` (num_envs, 4)."""
    return quat_rotate(quat_conjugate(quat_wxyz), vector)


_BOUND = 1000.0  # [m, m/s, rad/s] greater than any distance or speed of a rover


class MyDrive(Task):
    """Drive to a goal on the floor. The episode ends there.

    Args:
        tolerance: Distance at which the goal is reached [m].
        goal_distance: Minimum and maximum distance of the goal [m].
        progress_weight: Reward for each meter of progress toward the goal [1/m].
        time_penalty: Penalty per step.
        arrival_reward: Reward for reaching the goal.
    """

    rewards: ClassVar[Rewards] = {  # the terms that add up to each type of reward
        "dense": {
            "progress": RewardTerm(
                function=lambda task: task.last_distance - task.distance,
                weight="progress_weight",
                meaning="d before the step − d after it, where d is the distance to the goal",
                unit="m",
            ),
            "time": RewardTerm(
                function=lambda task: np.ones(len(task.distance)), weight="-time_penalty", meaning="1 at every step"
            ),
            "arrival": RewardTerm(
                function=lambda task: task.is_success(),
                weight="arrival_reward",
                meaning="1 if the robot is at the goal",
            ),
        },
        "sparse": {
            "arrival": RewardTerm(function=lambda task: task.is_success(), meaning="1 if the robot is at the goal")
        },
    }
    reset_options: ClassVar[Sequence[str]] = ("goal",)
    robots: ClassVar[Sequence[str]] = ("robot",)  # names of the robots that the task needs
    control_timestep: ClassVar[float] = 0.1  # [s] between two actions
    physics_timestep: ClassVar[float] = 0.005  # [s] duration of a physics step

    def __init__(
        self,
        *,
        tolerance: float = 0.15,
        goal_distance: tuple[float, float] = (0.5, 2.0),
        progress_weight: float = 2.0,
        time_penalty: float = 0.02,
        arrival_reward: float = 2.0,
    ) -> None:
        nearest, farthest = goal_distance
        if not 0.0 < tolerance < nearest <= farthest:
            raise ConfigurationError(
                f"tolerance {tolerance} and goal_distance {goal_distance} must satisfy 0 < tolerance < nearest ≤ "
                "farthest."
            )
        self.tolerance = tolerance
        self.goal_distance = goal_distance
        self.progress_weight = progress_weight
        self.time_penalty = time_penalty
        self.arrival_reward = arrival_reward
        self.reward_type = self.reward_types[0]

    def scene(self) -> Scene:
        """Return the scene without the robot: a floor and a camera."""
        return Scene(cameras={"overview": Camera(pos=(0.0, -2.6, 2.8), target=(0.0, 0.0, 0.0))})

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Prepare for a simulation: store the robot's handle and allocate buffers."""
        self._robot = robot = control.robot("robot")
        self._start = [part.copy() for part in robot.base_pose]  # pos (num_envs, 3), quat_wxyz (num_envs, 4)
        self._goal: Floats = np.zeros((robot.num_envs, 3))
        self._way: Floats = np.zeros((robot.num_envs, 3))
        self.distance: Floats = np.zeros(robot.num_envs)
        self.last_distance: Floats = np.zeros(robot.num_envs)

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Begin an episode in the n environments selected by the mask: rotate the robot and choose a goal."""
        rows = rows_of(mask)
        heading = rng.uniform("heading", -np.pi, np.pi, mask=mask)  # (n,) [rad]
        self._robot.write_base_pose(
            self._start[0][rows], quat_from_axis_angle(np.array([0.0, 0.0, 1.0]), heading), mask
        )
        if "goal" in options:
            self._goal[rows, :2] = options["goal"][rows, :2]
        else:
            direction = rng.uniform("direction", -np.pi, np.pi, mask=mask)
            distance = rng.uniform("distance", *self.goal_distance, mask=mask)
            offset = distance[:, None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
            self._goal[rows, :2] = self._start[0][rows, :2] + offset
        self._measure()
        self.last_distance[rows] = self.distance[rows]

    def advance(self, context: StepContext) -> None:
        """Measure the quantities that the methods below use, once per control step."""
        self.last_distance = self.distance
        self._measure()

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return 5 numbers: the goal in the robot's frame, its distance, and the forward and angular velocity."""
        bound = np.full(2, _BOUND)

        def velocity() -> Floats:
            linear, angular = self._robot.base_twist
            forward = in_frame(self._robot.base_pose[1], linear)[:, :1]
            return np.concatenate([forward, angular[:, 2:]], axis=1)

        return {
            "goal": ObservationTerm(read=lambda: self._way[:, :2], low=-bound, high=bound, unit="m"),
            "distance": ObservationTerm(read=lambda: self.distance[:, None], low=-bound[:1], high=bound[:1], unit="m"),
            "velocity": ObservationTerm(read=velocity, low=-bound, high=bound, unit="m/s, rad/s"),
        }

    def is_terminated(self) -> Mask:
        """Return whether each robot is at its goal, (num_envs,) bool. Reaching the goal ends the episode."""
        return self.is_success()

    def is_success(self) -> Mask:
        """Return whether each robot is at its goal now, (num_envs,) bool."""
        return self.distance <= self.tolerance

    def markers(self) -> Sequence[Marker]:
        """Return markers to render in addition to the scene: the goal."""
        return (Marker(self._goal, self.tolerance),)

    def snapshot(self) -> Snapshot:
        """Return the state that the task keeps between steps, so that training can resume exactly."""
        return {"goal": self._goal.copy(), "last_distance": self.last_distance.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._goal[:] = snapshot["goal"]
        self.last_distance = snapshot["last_distance"].copy()
        self._measure()

    def _measure(self) -> None:
        pos, quat = self._robot.base_pose
        way = self._goal - pos
        way[:, 2] = 0.0  # the goal is on the floor, regardless of the height of the robot's root link
        self._way = in_frame(quat, way)
        self.distance = np.sqrt((way**2).sum(axis=-1))


if __name__ == "__main__":  # python my_drive.py checks the task's contract
    from my_rover import MY_ROVER

    from frobs_core.plugins.records import Level, TaskRecord
    from frobs_devkit.testing import check_task, run_checks

    needs = {"teleport": Level.APPROXIMATE}  # each episode starts from a different state
    record = TaskRecord(name="my_drive", summary="a wheeled robot drives", entry_point="__main__:MyDrive", needs=needs)
    for result in run_checks(check_task(record, robot=MY_ROVER, controller="differential_drive")).results:
        print(result.status, result.name, result.message)
