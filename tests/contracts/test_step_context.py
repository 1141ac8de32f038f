"""What a task may know about the step that was just taken."""

from __future__ import annotations

import numpy as np
import pytest

from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.plugins.records import TaskRecord
from frobs_tasks_reach import Reach


class SmoothReach(Reach):
    """Reaching that rewards small changes of the action, and nothing else."""

    def reward(self, context):
        change = (context.action - context.previous_action) ** 2.0
        return -change.reshape(self._robot.num_envs, -1).sum(axis=1)


class SmoothRecord(TaskRecord):
    """A record whose implementation needs no import."""

    def load(self):
        return SmoothReach


KEYWORDS = {
    "task": SmoothRecord(name="smooth", summary="", entry_point="nowhere:SmoothReach"),
    "robot": "irb120",
    "num_threads": 1,
}


@pytest.fixture(params=["mujoco", "pybullet"])
def simulator(request):
    return request.param


def test_the_change_of_the_action_is_that_of_clipped_actions_within_an_episode(simulator):
    env = RobotEnv(**KEYWORDS, simulator=simulator, controller="joint_delta_position")
    for _ in range(2):
        env.reset(seed=0)
        assert env.step(np.full(6, 2.0))[1] == -6.0  # from zero
        action = np.full(6, 0.5)
        assert env.step(action)[1] == -6 * 0.25
        action[:] = -1.0  # the caller may use its array again
        assert env.step(action)[1] == -6 * 2.25
    env.close()


def test_each_environment_of_a_vector_forgets_at_its_own_reset():
    env = RobotVectorEnv(**KEYWORDS, controller="joint_delta_position", num_envs=3, autoreset_mode="Disabled")
    env.reset(seed=0)
    env.step(np.ones((3, 6)))
    env.reset(options={"reset_mask": np.array([False, True, False])})
    assert env.step(np.ones((3, 6)))[1].tolist() == [0.0, -6.0, 0.0]
    snapshot = env.snapshot()
    expected = env.step(np.zeros((3, 6)))[1]
    env.step(np.ones((3, 6)))
    env.restore(snapshot)
    assert env.step_context.action.tolist() == np.ones((3, 6)).tolist()
    assert (env.step(np.zeros((3, 6)))[1] == expected).all()
    env.close()


def test_actions_of_a_discrete_space_are_whole_numbers():
    env = RobotEnv(**KEYWORDS, controller="discrete")
    env.reset(seed=0)
    env.step(3)
    assert env.step(1)[1] == -4.0
    assert env.step_context.action.dtype == np.int64
    env.close()


@pytest.mark.parametrize("controller", ["joint_delta_position", "tcp_delta_pose", "tcp_impedance"])
def test_commands_are_those_in_force_at_the_end_of_the_step(simulator, controller):
    env = RobotEnv(**KEYWORDS, simulator=simulator, controller=controller)
    commanded = []
    command = env.robot.command
    env.robot.command = lambda values: (commanded.append(values.copy()), command(values))[1]
    env.reset(seed=0)
    for _ in range(3):
        env.step(env.action_space.sample())
    assert list(env.step_context.commands) == ["robot"]
    last = commanded[-1] if commanded[-1].ndim == 2 else commanded[-1][:, -1]
    assert (env.step_context.commands["robot"] == last).all()
    env.close()
