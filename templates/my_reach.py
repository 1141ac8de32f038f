"""The task: an arm moves its tool to a goal and holds it there.

The task handles any number of environments at once: every array has one row per environment. Use only functions that
work row by row, not matrix products or means over the environments, because environments must not affect each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Control, Simulation, Snapshot, StepContext, Task
from frobs_core.description import Camera, Marker, ObservationTerm, Rewards, RewardTerm, Scene
from frobs_core.models import longest_reach
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError, UnsuitableRobotError
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import quat_conjugate, quat_rotate

_POSTURES = 8192  # number of random postures; those above the floor provide the goals, so every goal is reachable
_FLOOR_CLEARANCE = 0.05  # [m] minimum height of a posture above the floor
_OUTERMOST = 2.5  # [%] of the positions are omitted at each end of each axis, because only a stretched arm reaches them


def distance_to(goal: Floats, position: Floats) -> Floats:
    """Return the distances (num_envs,) [m] between goals (num_envs, 3) and positions (num_envs, 3) [m]."""
    return np.asarray(np.sqrt(((goal - position) ** 2).sum(axis=-1)))


def seen_from(quat_wxyz: Floats, vector: Floats) -> Floats:
    """Convert world-frame vectors (num_envs, 3) to a frame with the orientation ``quat_wxyz`` (num_envs, 4)."""
    return quat_rotate(quat_conjugate(quat_wxyz), vector)


def closeness(distance: Floats, width: float) -> Floats:
    """Return values in (0, 1], (num_envs,): 1 at the goal, and 0.37 at a distance of ``width`` [m] from the goal."""
    return np.exp(-((distance / width) ** 2))


class MyReach(Task):
    """Move the tool center point to a goal, and hold it there until the time limit.

    Args:
        tolerance: Distance at which the goal is reached [m].
        precision_weight: Weight of the reward term for the last few centimeters.
        start_noise: Maximum deviation of each joint from its home position at the start of an episode [rad or m].
    """

    rewards: ClassVar[Rewards] = {  # the terms that add up to each type of reward
        "dense": {
            "distance": RewardTerm(
                function=lambda task: task.distance,
                weight=-1.0,
                meaning="d, where d is the distance from the tool to the goal",
                unit="m",
            ),
            "precision": RewardTerm(
                function=lambda task: closeness(task.distance, task.tolerance),
                weight="precision_weight",
                meaning="exp(−(d / tolerance)²)",
            ),
        },
        "sparse": {
            "missed": RewardTerm(
                function=lambda task: np.where(task.distance <= task.tolerance, 0.0, -1.0),
                meaning="−1 if d > tolerance, otherwise 0",
            )
        },
    }
    reset_options: ClassVar[Sequence[str]] = ("goal", "joint_positions")
    robots: ClassVar[Sequence[str]] = ("robot",)  # names of the robots that the task needs
    control_timestep: ClassVar[float] = 0.04  # [s] between two actions
    physics_timestep: ClassVar[float] = 0.002  # [s] duration of a physics step

    def __init__(self, *, tolerance: float = 0.05, precision_weight: float = 0.5, start_noise: float = 0.05) -> None:
        if not tolerance > 0.0:
            raise ParameterValueError("tolerance", tolerance, "above 0 [m]")
        self.tolerance = tolerance
        self.precision_weight = precision_weight
        self.start_noise = start_noise
        self.reward_type = self.reward_types[0]

    def scene(self) -> Scene:
        """Return the scene without the robot: a floor and a camera."""
        return Scene(cameras={"overview": Camera(pos=(1.4, -1.4, 1.1), target=(0.0, 0.0, 0.35))})

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Prepare for a simulation: determine the reachable positions and allocate buffers."""
        self._robot = robot = control.robot("robot")
        self._reachable = self._survey()  # (k, 3) [m]
        self._shoulder = robot.model.actuated_joints[0].child
        self._goal: Floats = np.zeros((robot.num_envs, 3))
        self._tcp: Floats = np.zeros((robot.num_envs, 3))
        self.distance: Floats = np.zeros(robot.num_envs)

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Begin an episode in the n environments selected by the mask: place the robot and choose a goal."""
        rows = rows_of(mask)
        robot = self._robot
        if "joint_positions" in options:
            positions = options["joint_positions"][rows]
        else:
            noise = rng.uniform("start", -self.start_noise, self.start_noise, (robot.dof,), mask)
            positions = robot.home[rows] + noise
        robot.write_joint_state(np.clip(positions, robot.position_lower[rows], robot.position_upper[rows]), mask=mask)
        if "goal" in options:
            self._goal[rows] = options["goal"][rows]
        else:
            self._goal[rows] = self._reachable[rng.integers("goal", 0, len(self._reachable), mask=mask)]
        self._measure()

    def advance(self, context: StepContext) -> None:
        """Measure the quantities that the methods below use, once per control step."""
        self._measure()

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return joint positions, tool position, goal, and two vectors from tool to goal: dof + 12 numbers.

        One vector is in the world frame, and the other is in the frame of the first moving link. Given the second
        vector, the required motion of the other joints does not depend on the first joint's angle. A learner may
        multiply each term by its scale, so that relevant differences are about 1.
        """
        robot = self._robot
        reach = longest_reach(robot.model, robot.tcp)
        low, high = robot.base_pose[0][0] - reach, robot.base_pose[0][0] + reach
        far = np.full(3, np.sqrt(((high - low) ** 2).sum()))
        lower, upper = robot.position_lower[0], robot.position_upper[0]
        margin = 0.1 * (upper - lower)  # drives may overshoot a limit

        def joints() -> Floats:
            return robot.joint_positions

        def way() -> Floats:
            return self._goal - self._tcp

        def turned_way() -> Floats:
            return seen_from(robot.frame_pose(self._shoulder)[1], way())

        return {
            "joint_positions": ObservationTerm(read=joints, low=lower - margin, high=upper + margin, unit="rad or m"),
            "tcp_position": ObservationTerm(read=lambda: self._tcp, low=low, high=high, unit="m", scale=2.0),
            "goal": ObservationTerm(read=lambda: self._goal, low=low, high=high, unit="m", scale=2.0),
            "goal_offset": ObservationTerm(read=way, low=low - high, high=high - low, unit="m", scale=2.0),
            "goal_from_shoulder": ObservationTerm(read=turned_way, low=-far, high=far, unit="m", scale=5.0),
        }

    def is_success(self) -> Mask:
        """Return whether each tool is at its goal, (num_envs,) bool. The last step determines an episode's success."""
        return self.distance <= self.tolerance

    # An episode ends at the time limit. To end it earlier, implement is_terminated().

    def markers(self) -> Sequence[Marker]:
        """Return markers to render in addition to the scene: the goal."""
        return (Marker(self._goal, self.tolerance),)

    def snapshot(self) -> Snapshot:
        """Return the state that the task keeps between steps, so that training can resume exactly."""
        return {"goal": self._goal.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._goal[:] = snapshot["goal"]
        self._measure()

    def _measure(self) -> None:
        self._tcp = self._robot.frame_pose("tcp")[0].copy()
        self.distance = distance_to(self._goal, self._tcp)

    def _survey(self) -> Floats:
        """Return tool positions (k, 3) [m] of postures with the whole arm above the floor.

        Every call returns the same positions.
        """
        robot = self._robot
        low = np.where(np.isinf(robot.position_lower[0]), -np.pi, robot.position_lower[0])
        high = np.where(np.isinf(robot.position_upper[0]), np.pi, robot.position_upper[0])
        postures = RandomSource(1).uniform("survey", low, high, (_POSTURES, robot.dof))[0]
        lowest: Floats = np.full(_POSTURES, np.inf)
        for joint in robot.model.actuated_joints[1:]:  # the first link's position is the same in all postures
            lowest = np.minimum(lowest, robot.frame_pose(joint.child, postures)[0][:, 2])
        tool = robot.frame_pose("tcp", postures)[0].copy()
        clear = np.minimum(lowest, tool[:, 2]) > _FLOOR_CLEARANCE
        if not clear.any():
            raise UnsuitableRobotError(robot.robot.name, f"penetrates the floor in all {_POSTURES} sampled postures.")
        tool = tool[clear]
        inner, outer = np.percentile(tool, (_OUTERMOST, 100.0 - _OUTERMOST), axis=0)
        return np.asarray(tool[((tool >= inner) & (tool <= outer)).all(axis=-1)])


if __name__ == "__main__":  # python my_reach.py checks the task's contract
    from frobs_core.plugins.records import Level, TaskRecord
    from frobs_devkit.testing import check_task, run_checks

    needs = {"teleport": Level.APPROXIMATE}  # each episode starts from a different state
    record = TaskRecord(name="my_reach", summary="an arm reaches", entry_point="__main__:MyReach", needs=needs)
    for result in run_checks(check_task(record, robot="irb120", controller="joint_delta_position")).results:
        print(result.status, result.name, result.message)
