"""Joint groups: each has its own controller and command mode, and one action moves them all."""

from contextlib import closing
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from arm_and_gripper import ARM, CUBE_TASK, FINGERS

from frobs_core.contracts import CommandMode
from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import (
    ConflictingOptionsError,
    IncompatibleSpaceError,
    MissingSettingError,
    ParameterValueError,
    SettingError,
    UnknownNameError,
    UnknownParameterError,
    UnsuitableRobotError,
)

SIMULATORS = ["mujoco", "pybullet"]


@pytest.fixture(scope="module")
def gripping():
    return ARM.attach("flange", FINGERS, name="hand")


def make(robot, num_envs=None, **keywords):
    keywords = {"task": CUBE_TASK, "robot": robot, "controller": "joint_delta_position", **keywords}
    return RobotEnv(**keywords) if num_envs is None else RobotVectorEnv(num_envs, **keywords)


def test_groups_come_from_the_parts(gripping):
    assert list(gripping.groups) == ["arm", "hand"]
    assert gripping.groups["hand"] == ("hand_left", "hand_right")
    assert gripping.tcp == "hand_tcp"
    assert gripping.default_controllers == {"hand": "gripper_position"}


def test_actions_are_joined_in_the_order_of_the_groups(gripping):
    with closing(make(gripping)) as env:
        assert env.action_space == gym.spaces.Box(-1.0, 1.0, (8,), np.float32)
        assert list(env.control.controllers) == ["robot/arm", "robot/hand"]
        env.reset(seed=0)
        before = env.robot.joint_positions[0].copy()
        for _ in range(20):
            env.step(np.array([0.1, *np.zeros(6), -1.0]))
        moved = env.robot.joint_positions[0] - before
        assert moved[0] > 0.1  # the arm's first joint
        assert np.abs(env.robot.joint_positions[0, -2:]).max() < 1e-3  # closed


def test_groups_know_their_name_and_the_end_effector_that_they_carry_or_move(gripping):
    hand = gripping.end_effectors["hand"]
    pointer = replace(hand, tcp="link_3", group="", open={}, closed={})
    with closing(make(replace(gripping, end_effectors={"pointer": pointer, "hand": replace(hand, arm="hand")}))) as env:
        arm, fingers = (env.robot.group(joints, name=name) for name, joints in gripping.groups.items())
        assert (arm.group_name, arm.end_effector, arm.tcp) == ("arm", pointer, "link_3")
        assert (fingers.group_name, fingers.end_effector.group) == ("hand", "hand")
        assert (env.robot.group_name, env.robot.end_effector.group) == ("", "hand")  # the gripper comes first
        other = env.robot.group(env.robot.joint_names[:2])
        assert (other.group_name, other.end_effector, other.tcp) == ("", None, env.robot.tcp)


def test_ungrouped_robot_is_the_group_all():
    with closing(make("irb120")) as env:
        assert (env.robot.group_name, env.robot.end_effector) == ("all", None)


def test_tcp_of_is_deprecated(gripping):
    with pytest.warns(FrobsDeprecationWarning, match=r"RobotHandle\.group"):
        assert gripping.tcp_of("arm") == "hand_tcp"


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_every_joint_has_its_own_command_mode(gripping, simulator):
    with closing(make(gripping, controller="joint_velocity", simulator=simulator)) as env:
        modes = env.robot.command_modes
        assert modes == (CommandMode.VELOCITY,) * 7 + (CommandMode.POSITION,) * 2
        env.reset(seed=0)
        for _ in range(10):
            env.step(np.array([0.2, *np.zeros(6), 1.0]))
        assert env.robot.joint_velocities[0, 0] == pytest.approx(0.2 * 2.2, rel=0.05)
        assert env.robot.joint_positions[0, -2:] == pytest.approx(0.04, abs=1e-3)
        with pytest.raises(UnsuitableRobotError, match="different command modes"):
            _ = env.robot.command_mode


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_joints_without_a_controller_hold_their_home_position(gripping, simulator):
    controller = {"arm": "joint_delta_position", "hand": None}
    with closing(make(gripping, controller=controller, simulator=simulator)) as env:
        assert env.action_space.shape == (7,)
        env.reset(seed=0)
        for _ in range(10):
            env.step(env.action_space.sample())
        assert env.robot.joint_positions[0, -2:] == pytest.approx(0.04, abs=2e-3)


def test_discrete_controllers_become_a_multidiscrete_space(gripping):
    controller = {"arm": "discrete", "hand": "discrete"}
    kwargs = {"hand": {"controller": "gripper_delta"}}
    with closing(make(gripping, controller=controller, controller_kwargs=kwargs)) as env:
        assert env.action_space == gym.spaces.MultiDiscrete([15, 3])
        env.reset(seed=0)
        for _ in range(10):
            env.step(np.array([0, 1]))  # stay; close
        assert env.robot.joint_positions[0, -1] < 0.005


def test_a_mixture_of_action_spaces_names_the_controller_that_fixes_it(gripping):
    with pytest.raises(IncompatibleSpaceError, match="'discrete' converts a Box space to a Discrete space"):
        make(gripping, controller={"arm": "discrete", "hand": "gripper_delta"})


@pytest.mark.parametrize(
    ("keywords", "error", "says"),
    [
        ({"controller": {"leg": "joint_position"}}, UnknownNameError, "joint group of robot .* 'leg'.* arm, hand"),
        ({"controller": {"arm": None, "hand": None}}, MissingSettingError, "needs a controller"),
        ({"controller": {"arm": "joint_positoin"}}, UnknownNameError, "Did you mean 'joint_position'"),
        ({"controller": {"arm": "joint_position"}, "controller_kwargs": {"speed": 1}}, UnknownNameError, "'speed'"),
        (
            {"controller": {"arm": "joint_position"}, "controller_kwargs": {"arm": 1}},
            ParameterValueError,
            "kwargs.arm is 1",
        ),
        (
            {"controller": {"hand": None}, "controller_kwargs": {"arm": None, "hand": {"max_delta": 0.1}}},
            MissingSettingError,
            "joint group 'hand' .* needs a controller",
        ),
        ({"robots": {"a": "irb120"}}, ConflictingOptionsError, "robot and robots cannot be combined"),
    ],
)
def test_wrong_settings_are_named(gripping, keywords, error, says):
    with pytest.raises(error, match=says):
        make(gripping, **keywords)


def test_groups_that_share_a_joint_are_rejected():
    with pytest.raises(UnsuitableRobotError, match="'joint_1' in two groups, 'a' and 'b'"):
        make(replace(ARM, groups={"a": ("joint_1",), "b": ("joint_1", "joint_2")}))
    with pytest.raises(UnsuitableRobotError, match="no actuated joint 'joint_9'"):
        make(replace(ARM, groups={"a": ("joint_9",)}))


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_each_environment_of_many_equals_the_single_one(gripping, simulator):
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (15, 3, 7)).astype(np.float32)
    keywords = {"controller": {"arm": "tcp_delta_pose", "hand": "gripper_delta"}, "simulator": simulator}
    with closing(make(gripping, 3, **keywords)) as many:
        many.reset(seed=5)
        together = [many.step(action)[0] for action in actions]
    for i in range(3):
        with closing(make(gripping, **keywords)) as one:
            one.reset(seed=5 + i)
            for k in range(15):
                assert (one.step(actions[k, i])[0] == together[k][i]).all()


def test_a_snapshot_continues_with_the_same_bits(gripping):
    keywords = {"controller": {"arm": "tcp_delta_position", "hand": "gripper_delta"}}
    with closing(make(gripping, 2, **keywords)) as env:
        env.reset(seed=0)
        actions = np.random.default_rng(1).uniform(-1.0, 1.0, (12, 2, 4))
        for action in actions[:6]:
            env.step(action)
        kept = env.snapshot()
        assert {key.split("/")[1] + "/" + key.split("/")[2] for key in kept if key.startswith("controller/")} == {
            "robot/arm",
            "robot/hand",
        }
        first = [env.step(action)[0] for action in actions[6:]]
        env.restore(kept)
        assert all((env.step(a)[0] == b).all() for a, b in zip(actions[6:], first, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("simulator", SIMULATORS)
def test_an_impedance_controller_yields_like_a_spring(gripping, simulator):
    """A force F at the tool moves it by F / K, and it returns when the force ends."""
    controller = {"arm": "tcp_impedance", "hand": None}
    kwargs = {"arm": {"stiffness": 500.0}}
    with closing(make(gripping, controller=controller, controller_kwargs=kwargs, simulator=simulator)) as env:
        env.reset(seed=0)
        for _ in range(25):
            env.step(np.zeros(3))
        rest = env.robot.frame_pose("tcp")[0][0].copy()
        for _ in range(40):
            env.simulation.apply_wrench("robot/hand_hand", np.array([[0.0, 10.0, 0.0]]), np.zeros((1, 3)))
            env.step(np.zeros(3))
        pushed = env.robot.frame_pose("tcp")[0][0] - rest
        assert pushed[1] == pytest.approx(10.0 / 500.0, rel=0.1)
        for _ in range(40):
            env.step(np.zeros(3))
        assert np.abs(env.robot.frame_pose("tcp")[0][0] - rest).max() < 2e-3


def test_a_controller_at_the_physics_rate_cannot_be_delayed(gripping):
    with pytest.raises(SettingError, match="physics rate"):
        make(gripping, controller={"arm": "tcp_impedance"}, randomize={"action_delay": {"steps": 1}})


def test_several_robots_have_their_own_actions_and_places():
    robots = {
        "left": {"robot": "irb120", "pose": {"pos": [0.0, 0.5, 0.0]}},
        "right": {
            "robot": "ur5",
            "controller": "joint_position",
            "pose": {"pos": [0.0, -0.5, 0.0], "rpy": [0, 0, 1.0]},
        },
    }
    with closing(RobotEnv(task=CUBE_TASK, robots=robots, controller="joint_delta_position")) as env:
        assert env.action_space.shape == (12,)
        assert list(env.control.controllers) == ["left/all", "right/all"]
        assert env.simulation.robots["left"].base_pose[0][0].tolist() == [0.0, 0.5, 0.0]
        env.reset(seed=0)
        before = {name: robot.joint_positions.copy() for name, robot in env.simulation.robots.items()}
        for _ in range(10):
            env.step(np.array([0.5, *np.zeros(5), *np.zeros(6)]))
        moved = {
            name: np.abs(robot.joint_positions - before[name]).max(axis=0)
            for name, robot in env.simulation.robots.items()
        }
        assert moved["left"][0] > 0.1
        assert moved["left"][1:].max() < 0.05
        config = env.config
    assert EnvConfig.from_dict({"task": CUBE_TASK, "controller": "joint_delta_position", "robots": robots}) == config


def test_robots_at_one_place_are_rejected():
    with pytest.raises(ConflictingOptionsError, match="both robots have the position"):
        RobotEnv(task=CUBE_TASK, robots={"a": "irb120", "b": "irb120"}, controller="joint_position")
    with pytest.raises(UnknownParameterError, match=r"robots\.a has no parameter 'contoller'"):
        RobotEnv(task=CUBE_TASK, robots={"a": {"robot": "irb120", "contoller": "x"}}, controller="joint_position")


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_robot_moves_smoothly_beside_one_that_is_controlled_at_each_physics_step(simulator):
    smooth = {
        "robot": "irb120",
        "controller": "tcp_delta_pose",
        "controller_kwargs": {"interpolate": True},
        "pose": {"pos": [0, -1, 0]},
    }
    yielding = {"robot": "irb120", "controller": "tcp_impedance", "pose": {"pos": [0, 1, 0]}}
    seen = []
    for robots in ({"one": smooth}, {"one": smooth, "other": yielding}):
        with closing(RobotEnv(task="reach_together", robots=robots, simulator=simulator)) as env:
            env.reset(seed=0)
            for _ in range(3):
                env.step(np.full(env.action_space.shape, 0.3))
            seen.append(env.simulation.robots["one"].joint_positions[0].copy())
    assert seen[0] == pytest.approx(seen[1], abs=1e-9)
