"""RobotBasicEnv against the bridge over MuJoCo and over a real Gazebo 11."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env

from frobs_core.util.errors import ConfigurationError, EnvironmentCopyError, ResetNeededError
from frobs_rl_compat.ros import ros_gazebo
from frobs_rl_compat.ros.robot_basic_env import RobotBasicEnv
from frobs_ros.errors import PackageNotFoundError, RosError
from frobs_ros.ros import processes

CONTROLLERS = ["joint_state_controller", "arm_controller"]


class ArmEnv(RobotBasicEnv):
    """Moves the tiny arm; observes its joint positions, through topics."""

    def __init__(self, **given: Any) -> None:
        import rospy
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64MultiArray

        whole = {
            "spawn_robot": True,
            "pkg_name": "tiny_arm",
            "urdf_file": "arm.urdf.xacro",
            "controller_file": "controllers.yaml",
            "controller_list": CONTROLLERS,
            "model_name_in_gazebo": "env_arm",
            "namespace": "/env",
            "step_mode": 2,
            "num_gazebo_steps": 20,
        }
        super().__init__(**(whole | given))
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = spaces.Box(-3.0, 3.0, (2,), np.float32)
        self.calls: list[str] = []
        self.state = JointState()
        self.command = rospy.Publisher("/env/arm_controller/command", Float64MultiArray, queue_size=1)
        self.states = rospy.Subscriber("/env/joint_states", JointState, self._keep)

    def _keep(self, message: Any) -> None:
        self.state = message

    def _send_action(self, action: Any) -> None:
        from std_msgs.msg import Float64MultiArray

        self.calls.append("action")
        self.command.publish(Float64MultiArray(data=[float(part) for part in action]))

    def _get_observation(self) -> Any:
        self.calls.append("observation")
        return np.array(self.state.position or (0.0, 0.0), np.float32).clip(-3, 3)

    def _get_reward(self) -> float:
        self.calls.append("reward")
        return -float(np.abs(self._goal).sum())

    def _check_if_done(self) -> bool:
        self.calls.append("done")
        self.info["is_success"] = 1.0
        return False

    def _check_subs_and_pubs_connection(self) -> bool:
        until = time.monotonic() + 20.0
        while not self.state.position:
            assert time.monotonic() < until
            time.sleep(0.01)
        return True

    def _set_episode_init_params(self) -> None:
        self._goal = self.np_random.uniform(-1.0, 1.0, 2)


@pytest.fixture
def env(world: None) -> Iterator[ArmEnv]:
    env = ArmEnv(reset_controllers=True)
    yield env
    env.close()


def sim_time() -> float:
    from gazebo_msgs.srv import GetWorldProperties

    from frobs_ros.ros.services import call

    return float(call("/gazebo/get_world_properties", GetWorldProperties).sim_time)


def is_paused() -> bool:
    before = sim_time()
    time.sleep(0.05)
    return sim_time() == before


@pytest.mark.ros_feature("RobotBasicEnv of FRobs_RL", "mujoco", "gazebo")
def test_an_episode_runs_and_each_step_takes_its_physics_steps(env: ArmEnv) -> None:
    _, info = env.reset(seed=3)
    assert info == {}
    assert is_paused()
    env.calls.clear()
    for _ in range(30):
        before = sim_time()
        observation, _, terminated, truncated, info = env.step(np.array([0.5, -0.5]))
        assert sim_time() - before == pytest.approx(20 * ros_gazebo.gazebo_get_time_step())
        assert (terminated, truncated, info) == (False, False, {"is_success": 1.0})
    assert env.calls[:4] == ["action", "observation", "reward", "done"]
    assert observation == pytest.approx([0.5, -0.5], abs=0.2)


@pytest.mark.ros_feature("RobotBasicEnv of FRobs_RL", "mujoco", "gazebo")
def test_seeds_repeat_and_options_are_kept(env: ArmEnv) -> None:
    goals = []
    for seed in (1, 2, 1):
        env.reset(seed=seed, options={"level": seed})
        goals.append(tuple(env._goal))
        assert env.reset_options == {"level": seed}
    assert goals[0] == goals[2] != goals[1]


@pytest.mark.ros_feature("RobotBasicEnv of FRobs_RL", "mujoco", "gazebo")
def test_mode_1_lets_the_time_run_during_the_action_and_mode_2_resets_the_clock(world: None) -> None:
    env = ArmEnv(step_mode=1, num_gazebo_steps=1, reset_mode=2)
    try:
        env.reset(seed=0)
        before = sim_time()
        env.step(np.zeros(2))
        assert sim_time() >= before
        assert is_paused()
        env.reset()
        assert sim_time() < 5.0
    finally:
        env.close()


@pytest.mark.ros_feature("RobotBasicEnv of FRobs_RL", "mujoco", "gazebo")
def test_gymnasium_is_content(env: ArmEnv, recwarn: pytest.WarningsRecorder) -> None:
    env._get_observation = lambda: np.zeros(2, np.float32)  # type: ignore[method-assign] # topics repeat no noise to the bit
    check_env(env, skip_render_check=True, skip_close_check=True)


@pytest.mark.ros_feature("RobotBasicEnv of FRobs_RL", "mujoco", "gazebo")
def test_closing_ends_what_the_environment_started_and_nothing_else(env: ArmEnv) -> None:
    (publisher,) = [process for process in processes.owned() if process.kind == "state publisher"]
    env.close()
    env.close()
    assert not publisher.is_running
    assert ros_gazebo.gazebo_step_physics(1)  # the simulation was not the environment's
    with pytest.raises(ResetNeededError, match="step was called on a closed environment"):
        env.step(np.zeros(2))


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"reset_mode": 3}, "reset_mode is 3; it must be 1 or 2"),
        ({"step_mode": 0}, "step_mode is 0"),
        ({"num_gazebo_steps": 0}, "num_gazebo_steps is 0"),
        ({"gazebo_timestep": -0.1}, "gazebo_timestep is -0.1"),
        ({"model_ori_w": 2.0}, "has the norm 2 "),
        ({"spawn_robot": True}, "spawn_robot needs pkg_name and urdf_file"),
        ({"reset_controllers": True}, "reset_controllers needs controller_list"),
        ({"launch_gazebo": True, "gazebo_recording": True}, "recording is not supported by the backend"),
        ({"launch_gazebo": True, "world_path": "/no/such.world"}, "/no/such.world does not exist"),
        ({"launch_gazebo": True, "world_pkg": "tiny_arm"}, "needs the names of both the package and the world file"),
    ],
)
def test_what_cannot_be_meant_is_refused_before_anything_is_started(
    own_master: str, given: dict[str, Any], reason: str
) -> None:
    before = processes.owned()
    with pytest.raises(ConfigurationError, match=reason.replace("'", ".")):
        RobotBasicEnv(**given)
    assert processes.owned() == before


def test_arguments_that_have_no_use_are_logged(own_master: str, reasons: Callable[[], str]) -> None:
    RobotBasicEnv(world_path="/a.world", num_gazebo_steps=3).close()
    assert "world_path is ignored because launch_gazebo is False" in reasons()
    assert "num_gazebo_steps=3 is ignored" in reasons()


class LonelyArmEnv(ArmEnv):
    """Cannot do without a wall that is not there."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        ros_gazebo.gazebo_spawn_sdf_pkg("tiny_arm", "wall.sdf")


def test_a_constructor_whose_world_is_not_complete_fails_with_the_reason(world: None) -> None:
    before = processes.owned()
    with pytest.raises(PackageNotFoundError, match=r"has no file .*wall\.sdf"):
        LonelyArmEnv()
    assert processes.owned() == before
    assert ros_gazebo.gazebo_spawn_sdf_pkg("tiny_arm", "wall.sdf")[0] is False


def test_without_the_world_that_a_script_asked_for_there_is_no_environment(
    own_master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "owned", lambda kinds=(): [])  # a simulation of another test may run
    assert ros_gazebo.launch_Gazebo(custom_world_path="/nowhere.world") is False
    with pytest.raises(ConfigurationError, match=r"/nowhere\.world"):
        ArmEnv()


@pytest.mark.slow
def test_an_error_in_the_constructor_leaves_nothing_running(world: None) -> None:
    before = processes.owned()
    with pytest.raises(RosError, match="no_controller"):
        ArmEnv(controller_list=["no_controller"])
    assert processes.owned() == before


@pytest.mark.parametrize("hook", ["_send_action", "_get_observation", "_get_reward", "_check_if_done",
                                  "_check_subs_and_pubs_connection", "_set_episode_init_params"])  # fmt: skip
def test_a_hook_that_is_not_written_is_named(own_master: str, hook: str) -> None:
    env = RobotBasicEnv()
    with pytest.raises(NotImplementedError, match=hook):
        getattr(env, hook)(*([None] if hook == "_send_action" else []))
    env.close()


def test_an_environment_of_a_robot_in_ros_refuses_copies(own_master: str) -> None:
    env = RobotBasicEnv()
    for copied in (pickle.dumps, copy.deepcopy, copy.copy):
        with pytest.raises(EnvironmentCopyError, match="through ROS"):
            copied(env)
    env.close()


def test_an_error_in_a_hook_leaves_the_time_standing(env: ArmEnv, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(env, "_set_episode_init_params", fail)
    with pytest.raises(ZeroDivisionError):
        env.reset()
    assert is_paused()


ALONE = """
import os, signal, sys
from frobs_ros.ros import master, processes
from frobs_ros.errors import MasterError, RosError
from frobs_rl_compat.ros.robot_basic_env import RobotBasicEnv

class Env(RobotBasicEnv):
    def _send_action(self, action): pass
    def _get_observation(self): return 0
    def _get_reward(self): return 0.0
    def _check_if_done(self): return False
    def _check_subs_and_pubs_connection(self): return True
    def _set_episode_init_params(self): pass
"""


def run_alone(script: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", ALONE + script], capture_output=True, text=True, check=False, timeout=200
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_without_roscore_an_environment_says_so(lonely: str) -> None:
    script = """
env = Env()
try:
    env.reset()
except MasterError as error:
    print(error)
"""
    assert run_alone(script).startswith(f"no ROS master responds at {lonely}")


@pytest.mark.slow
def test_an_environment_brings_its_own_simulation_and_roscore_may_die_in_mid_episode(
    lonely: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = """
env = Env(launch_gazebo=True, gazebo_use_gui=False, gazebo_timestep=0.002, gazebo_max_freq=10, step_mode=2,
          world_pkg="tiny_arm", world_filename="box.world")
env.reset(seed=0)
env.step(0)
print(sorted(process.kind for process in processes.owned()))
(rosmaster,) = processes.owned(["master"])
for pid in rosmaster.pids():
    os.kill(pid, signal.SIGKILL)
while master.is_online():
    pass
try:
    env.reset()
except MasterError:
    print("no master")
env.close()
print(processes.owned(["gazebo"]))
"""
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(Path(__file__).parent / "packages"))
    monkeypatch.setenv("FROBS_ROS_TIMEOUT", "10")
    assert run_alone(script) == "['gazebo', 'master']\nno master\n[]\n"
