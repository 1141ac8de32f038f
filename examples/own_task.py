"""Write your own task, and check it with the conformance kit.

The task is to move all joints of an arm to a random posture. The script prints the rewards of a simple controller that
moves each joint toward its goal. The rewards rise to 0. Then the script prints the results of the conformance kit, in
which no check fails.

To turn such a task into a plugin, run `frobs new task`, which creates the rest of the package.

Requires: pip install frobs
"""

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Control, Simulation, Snapshot, StepContext, Task
from frobs_core.description import ObservationTerm
from frobs_core.plugins.records import Level, TaskRecord
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.random import RandomSource
from frobs_devkit.testing import check_task, run_checks


class CopyPosture(Task):
    """Move all joints to a random posture. Every array has one row for each environment."""

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Store the robot, and allocate the goals."""
        self.robot = control.robot("robot")
        self.goal: Floats = self.robot.home.copy()  # (num_envs, dof) [rad]

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """In the environments that the mask selects, start at home with a new goal."""
        rows = rows_of(mask)
        self.robot.write_joint_state(self.robot.home[rows], mask=mask)
        self.goal[rows] = self.robot.home[rows] + rng.uniform("goal", -0.5, 0.5, (self.robot.dof,), mask)

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the differences between the goal and the joint positions."""
        far = np.full(self.robot.dof, 10.0)
        return {"difference": ObservationTerm(read=self.difference, low=-far, high=far, unit="rad")}

    def reward(self, context: StepContext) -> Floats:
        """Return the negative mean absolute difference, (num_envs,)."""
        return np.asarray(-np.abs(self.difference()).mean(axis=1))

    def is_success(self) -> Mask:
        """Return which arms have reached the posture, (num_envs,) bool."""
        return np.asarray((np.abs(self.difference()) < 0.05).all(axis=1))

    def snapshot(self) -> Snapshot:
        """Return the state that the task keeps between steps."""
        return {"goal": self.goal.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self.goal[:] = snapshot["goal"]

    def difference(self) -> Floats:
        """Return goal − joint positions, (num_envs, dof) [rad]."""
        return self.goal - self.robot.joint_positions


RECORD = TaskRecord(
    name="copy_posture",
    summary="an arm copies a posture",
    entry_point="__main__:CopyPosture",  # a plugin names its module here
    needs={"teleport": Level.APPROXIMATE},  # reset() writes joint positions
)
env = gym.make("frobs_core:frobs/Env-v0", task=RECORD, robot="irb120", controller="joint_delta_position")
observation, info = env.reset(seed=0)
for step in range(1, 21):
    observation, reward, terminated, truncated, info = env.step(np.clip(10.0 * observation, -1.0, 1.0))
    if step % 4 == 0:
        print(f"step {step:2}: reward {reward:6.3f}, success {info['is_success']}")
assert info["is_success"] == 1.0  # actions toward the goal reach it within 20 steps
env.close()

report = run_checks(check_task(RECORD, robot="irb120", controller="joint_delta_position"))
for result in report.results:
    print(f"{result.status}: {result.name}")
assert report.ok
