"""The environments, on MuJoCo and the IRB 120."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import frobs_core.plugins
from frobs_core.contracts import CommandMode, Controller
from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.plugins import registry
from frobs_core.plugins.records import ControllerRecord, Level, SimulatorRecord
from frobs_core.util.errors import (
    CapabilityError,
    ConfigurationError,
    InvalidActionError,
    InvalidTimestepError,
    ParameterValueError,
    PluginError,
    ResetNeededError,
    SimulationError,
    UnknownNameError,
    UnknownParameterError,
)

ID = "frobs_core:frobs/Irb120Reach-v0"
PARTS = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}


@pytest.fixture
def env():
    env = RobotEnv(**PARTS)
    yield env
    env.close()


@pytest.fixture
def vector():
    env = RobotVectorEnv(4, max_episode_steps=10, **PARTS)
    yield env
    env.close()


def test_the_compositional_id_combines_the_parts_by_name():
    env = gym.make("frobs_core:frobs/Env-v0", simulator="mujoco", **PARTS)
    assert env.reset(seed=0)[0].shape == (18,)
    assert env.unwrapped.robot.robot.name == "irb120"
    env.close()


def test_a_step_takes_exactly_the_control_timestep(env):
    env.reset(seed=0)
    for k in range(1, 4):
        env.step(env.action_space.sample())
        assert env.simulation.time[0] == pytest.approx(k * 0.04)


@pytest.mark.parametrize(
    ("keywords", "error", "says"),
    [
        ({"robot": "irb12"}, UnknownNameError, "Did you mean 'irb120'"),
        ({"simulator": "mujocco"}, UnknownNameError, "Did you mean 'mujoco'"),
        ({"controller": "joint_delta_positions"}, UnknownNameError, "Did you mean 'joint_delta_position'"),
        ({"task": "reech"}, UnknownNameError, "Did you mean 'reach'"),
        ({"tolerence": 0.1}, UnknownParameterError, "Did you mean 'tolerance'"),
        ({"controller_kwargs": {"max_dleta": 1}}, UnknownParameterError, "Did you mean 'max_delta'"),
        ({"reward_type": "shaped"}, ConfigurationError, "it must be one of 'dense', 'sparse'"),
        ({"render_mode": "rgb"}, ConfigurationError, "'rgb_array', 'human'"),
        ({"tcp": "tool1"}, UnknownNameError, "Did you mean 'tool0'"),
        ({"control_timestep": 0.003}, InvalidTimestepError, r"0\.004 s would work \(2 physics steps\)"),
        ({"physics_timestep": -1.0}, InvalidTimestepError, "must be positive"),
        ({"physics_timestep": float("nan")}, InvalidTimestepError, "must be positive"),
        ({"xacro_args": {"prefx": "a_"}}, Exception, "prefx"),
    ],
)
def test_bad_input_is_named(keywords, error, says):
    with pytest.raises(error, match=says):
        RobotEnv(**{**PARTS, **keywords})
    with pytest.raises(error, match=says):
        RobotVectorEnv(2, **{**PARTS, **keywords})


def test_a_task_without_a_reward_is_refused_before_the_simulation_is_built(monkeypatch):
    monkeypatch.setattr("frobs_tasks_reach.reach.Reach.rewards", {})
    with pytest.raises(PluginError, match="task 'reach': Reach defines no reward of type 'dense'"):
        RobotEnv(**PARTS)


PUSH = "frobs_core:frobs/PandaPush-v0"


@pytest.mark.parametrize(
    ("controller", "kwargs"),
    [
        ("joint_velocity", {}),
        ({"arm": "joint_velocity"}, {}),
        ({"arm": None, "gripper": "gripper_delta"}, {}),
        ("OWN", "THE ID'S"),
        ({"arm": "OWN", "gripper": None}, {"arm": "THE ID'S"}),
    ],
)
def test_another_controller_does_not_receive_the_keywords_of_the_controller_of_an_id(controller, kwargs):
    record = registry.find_environment(PUSH)[1]
    own, keywords = record.controller, record.parameters["controller_kwargs"]

    def told(value):
        if isinstance(value, dict):
            return {key: told(item) for key, item in value.items()}
        return {"OWN": own, "THE ID'S": keywords}.get(value, value)

    with closing(gym.make(PUSH, controller=told(controller))) as env:
        assert env.unwrapped.config.controller_kwargs == told(kwargs)
    with pytest.raises(UnknownParameterError, match="Did you mean 'max_velocity'"):
        gym.make(PUSH, controller="joint_velocity", controller_kwargs={"max_delta": 0.1})


def test_no_environments_are_refused():
    with pytest.raises(ConfigurationError, match="from 1 to 100,000"):
        RobotVectorEnv(0, **PARTS)


def test_a_simulator_that_lacks_something_is_refused_with_a_table(monkeypatch):
    poor = SimulatorRecord(name="poor", summary="", entry_point="nowhere:Nothing", capabilities={"drive": Level.EXACT})
    known = frobs_core.plugins.get_record
    monkeypatch.setattr(
        frobs_core.plugins, "get_record", lambda kind, name: poor if name == "poor" else known(kind, name)
    )
    with pytest.raises(CapabilityError) as caught:
        RobotEnv(**PARTS, simulator="poor", initial="random")
    assert caught.value.missing == (("task 'reach'", "teleport", "approximate", "unsupported"),)
    assert "needed by" in str(caught.value)


@pytest.fixture
def rooted(monkeypatch):
    """MuJoCo with a record that does not claim ``teleport``."""
    mujoco = frobs_core.plugins.get_record("simulator", "mujoco")
    return replace(mujoco, name="rooted", capabilities={**mujoco.capabilities, "teleport": Level.UNSUPPORTED})


def test_reaching_needs_teleporting_only_where_it_does_not_start_from_home(rooted):
    env = RobotEnv(**PARTS, simulator=rooted)
    first, _ = env.reset(seed=0)
    with pytest.raises(CapabilityError, match="task 'reach', reset with joint_positions  teleport"):
        env.reset(seed=5, options={"joint_positions": np.zeros(6)})
    env.reset(options={"goal": (0.3, 0.1, 0.4)})
    assert np.array_equal(first, env.reset(seed=0)[0])
    env.close()
    with pytest.raises(CapabilityError, match="task 'reach'  teleport"):
        RobotEnv(**PARTS, simulator=rooted, initial="random")


def test_a_vector_refuses_a_reset_that_needs_teleporting(rooted):
    env = RobotVectorEnv(2, **PARTS, simulator=rooted)
    env.reset(seed=0)
    with pytest.raises(CapabilityError, match="reset with joint_positions"):
        env.reset(options={"joint_positions": np.zeros(6)})
    env.close()


@pytest.mark.parametrize(
    ("action", "says"),
    [
        (np.zeros(5), r"shape \(5,\), but the action space has the shape \(6,\)"),
        (np.full(6, np.nan), "non-finite values at"),
        (np.array([0, 0, np.inf, 0, 0, 0]), r"non-finite values at the indices \[\[2\]\]; the first is inf"),
        (None, "shape"),
    ],
)
def test_a_wrong_action_is_refused_and_the_episode_goes_on(env, action, says):
    env.reset(seed=0)
    with pytest.raises(InvalidActionError, match=says):
        env.step(action)
    env.step(np.zeros(6))


def test_a_wrong_action_of_one_environment_is_refused(vector):
    vector.reset(seed=0)
    actions = np.zeros((4, 6))
    actions[2, 1] = np.nan
    with pytest.raises(InvalidActionError, match=r"\[\[2, 1\]\]"):
        vector.step(actions)


def test_a_discrete_action_outside_is_refused():
    for make in (RobotEnv, lambda **k: RobotVectorEnv(2, **k)):
        env = make(**{**PARTS, "controller": "discrete"})
        env.reset(seed=0)
        for number in (99, 0.5):
            with pytest.raises(InvalidActionError):
                env.step(np.full(env.action_space.shape, number))
        env.close()


def test_a_step_without_reset_is_refused(env, vector):
    for each in (env, vector):
        with pytest.raises(ResetNeededError, match="reset"):
            each.step(each.action_space.sample())


def test_reset_options_set_goal_and_joints(env, vector):
    goal, joints = np.array([0.3, 0.1, 0.5]), np.array([0.1, 0.2, 0.3, 0.0, 0.5, 0.0])
    env.reset(seed=0, options={"goal": goal, "joint_positions": joints})
    assert env.task.goal[0] == pytest.approx(goal)
    assert env.robot.joint_positions[0] == pytest.approx(joints)
    each = np.stack([goal + 0.01 * i for i in range(4)])
    vector.reset(seed=0, options={"goal": each})
    assert vector.task.goal == pytest.approx(each)


@pytest.mark.parametrize(
    ("options", "error", "says"),
    [
        ({"gaol": (0, 0, 0)}, UnknownParameterError, "Did you mean 'goal'"),
        ({"goal": (0, 0, float("nan"))}, ConfigurationError, "not finite"),
        ({"goal": np.zeros((3, 3))}, ConfigurationError, "3 rows"),
        ({"joint_positions": np.full(6, 9.0)}, ConfigurationError, "joint_1"),
    ],
)
def test_a_wrong_reset_option_is_refused(env, vector, options, error, says):
    for each in (env, vector):
        with pytest.raises(error, match=says):
            each.reset(seed=0, options=options)


def test_a_wrong_reset_mask_is_refused(vector):
    vector.reset(seed=0)
    for mask in (np.zeros(4, bool), np.ones(3, bool), np.ones(4)):
        with pytest.raises(ConfigurationError, match="reset_mask"):
            vector.reset(options={"reset_mask": mask})


def test_seeds_are_given_one_by_one_or_counted_up(vector):
    counted, _ = vector.reset(seed=5)
    listed, _ = vector.reset(seed=[5, 6, 7, 8])
    assert (counted == listed).all()
    changed, _ = vector.reset(seed=[5, None, 7, 8])
    assert (changed[[0, 2, 3]] == counted[[0, 2, 3]]).all()
    assert (changed[1] != counted[1]).any()
    with pytest.raises(ConfigurationError, match="number of seeds is 2"):
        vector.reset(seed=[1, 2])


@pytest.mark.parametrize("mode", AutoresetMode)
def test_each_autoreset_mode_keeps_its_promise(mode):
    env = RobotVectorEnv(3, max_episode_steps=4, autoreset_mode=mode, **PARTS)
    first, _ = env.reset(seed=0)
    for k in range(4):
        observation, _, _, truncated, info = env.step(np.zeros((3, 6)))
        assert truncated.all() == (k == 3)
        assert "is_success" in info
    if mode is AutoresetMode.SAME_STEP:
        assert info["_final_obs"].all()
        assert (np.stack(list(info["final_obs"])) == env.final_observation).all()
        assert info["final_info"]["_is_success"].all()
        assert not info["_is_success"].any()
        assert (observation[:, 9:12] != first[:, 9:12]).any()
    elif mode is AutoresetMode.NEXT_STEP:
        observation, reward, _, truncated, info = env.step(np.zeros((3, 6)))
        assert not truncated.any()
        assert not reward.any()
        assert not info["_is_success"].any()
        assert (observation[:, 9:12] != first[:, 9:12]).any()
    else:
        with pytest.raises(ResetNeededError, match=r"\[0, 1, 2\]"):
            env.step(np.zeros((3, 6)))
        env.reset(options={"reset_mask": np.array([True, False, True])})
        with pytest.raises(ResetNeededError, match=r"\[1\]"):
            env.step(np.zeros((3, 6)))
    env.close()


def test_staggered_episodes_end_at_different_times():
    env = RobotVectorEnv(32, max_episode_steps=8, stagger=True, **PARTS)
    for _ in range(2):
        env.reset(seed=0)
        ends = np.array([env.step(np.zeros((32, 6)))[3] for _ in range(16)])
        assert (ends.sum(axis=0) == 2).all()
        assert ends.any(axis=1).all()
        assert (ends[:8] == ends[8:]).all()
    env.close()
    with pytest.raises(ParameterValueError, match="stagger is True; it must be False without a time limit"):
        RobotVectorEnv(2, stagger=True, **PARTS)


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
def test_a_closed_vector_takes_no_step(simulator):
    env = RobotVectorEnv(2, simulator=simulator, num_threads=1, **PARTS)
    env.reset(seed=0)
    env.close()
    with pytest.raises(SimulationError, match="closed"):
        env.step(np.zeros((2, 6)))


def test_an_ended_episode_goes_on_when_its_row_is_restored():
    with closing(RobotVectorEnv(2, max_episode_steps=2, autoreset_mode="Disabled", **PARTS)) as env:
        env.reset(seed=0)
        begun, first, still = env.snapshot(), np.array([True, False]), np.zeros((2, 6))
        env.step(still)
        assert env.step(still)[3].all()
        env.restore_rows(first, begun, np.array([0]))
        env.reset(options={"reset_mask": ~first})
        assert not env.step(still)[3].any()


@pytest.mark.parametrize("keyword", [{"max_episode_steps": 0}, {"max_episode_steps": 2.5}, {"stagger": "no"}])
def test_an_impossible_time_limit_of_a_vector_is_refused(keyword):
    with pytest.raises(ParameterValueError, match=next(iter(keyword))):
        RobotVectorEnv(2, **{"max_episode_steps": 4, **keyword}, **PARTS)


def test_minus_one_is_no_time_limit_in_a_vector_as_in_gymnasium():
    with closing(RobotVectorEnv(2, max_episode_steps=-1, **PARTS)) as env:
        env.reset(seed=0)
        assert not env.step(np.zeros((2, 6)))[3].any()


def test_a_diverged_environment_is_truncated_and_the_others_go_on(vector):
    calm = RobotVectorEnv(4, max_episode_steps=10, **PARTS)
    for each in (vector, calm):
        each.reset(seed=0)
    vector.robot.write_joint_state(np.full((1, 6), np.nan), mask=np.array([False, True, False, False]))
    others = np.array([0, 2, 3])
    for k in range(3):
        actions = np.full((4, 6), 0.1)
        observation, reward, terminated, truncated, info = vector.step(actions)
        expected = calm.step(actions)
        assert truncated.tolist() == [False, k == 0, False, False]
        assert not terminated.any()
        assert np.isfinite(observation).all()
        assert np.isfinite(reward).all()
        assert (observation[others] == expected[0][others]).all()
        assert (reward[others] == expected[1][others]).all()
        if k == 0:
            assert info["final_info"]["frobs/diverged"].tolist() == [False, True, False, False]
    calm.close()


def test_a_single_environment_that_diverges_is_truncated(env):
    env.reset(seed=0)
    env.robot.write_joint_state(np.full((1, 6), np.nan))
    _, reward, terminated, truncated, info = env.step(np.zeros(6))
    assert (reward, terminated, truncated, info["frobs/diverged"]) == (0.0, False, True, True)
    with pytest.raises(ResetNeededError):
        env.step(np.zeros(6))
    env.reset()
    assert not env.step(np.zeros(6))[3]


def test_a_snapshot_continues_with_the_same_bits(vector):
    rng = np.random.default_rng(0)
    vector.reset(seed=0)
    for _ in range(7):
        vector.step(rng.uniform(-1, 1, (4, 6)))
    kept, actions = vector.snapshot(), rng.uniform(-1, 1, (20, 4, 6))
    first = [vector.step(action)[0] for action in actions]
    fresh = RobotVectorEnv(4, max_episode_steps=10, **PARTS)
    fresh.restore(kept)
    assert all((fresh.step(action)[0] == there).all() for action, there in zip(actions, first, strict=True))
    fresh.close()


def test_functions_after_a_reset_are_called_in_order_and_change_the_first_observation(vector):
    called = []
    vector.after_reset.append(lambda mask: called.append(("first", mask)))
    vector.after_reset.append(lambda mask: called.append(("second", mask)))
    there = np.linspace(0.0, 0.5, 6)
    vector.after_reset.append(lambda mask: vector.robot.write_joint_state(there[None], mask=mask))
    observation, _ = vector.reset(seed=0)
    assert called == [("first", None), ("second", None)]
    assert vector.robot.joint_positions == pytest.approx(np.tile(there, (4, 1)))
    assert observation[:, :6] == pytest.approx(np.tile(there, (4, 1)))
    mask = np.array([True, False, False, True])
    vector.reset(options={"reset_mask": mask})
    assert [name for name, _ in called[2:]] == ["first", "second"]
    assert all((given == mask).all() for _, given in called[2:])


def test_functions_after_a_step_get_its_result(env, vector):
    for each, actions in ((env, np.zeros(6)), (vector, np.zeros((4, 6)))):
        results = []
        each.reset(seed=0)
        each.after_step.append(results.append)
        observation, reward, *_ = each.step(actions)
        ((shown, rewards, *_),) = results
        assert (shown == observation).all()
        assert (rewards == reward).all()


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_functions_before_an_autoreset_see_the_last_state(mode):
    vector = RobotVectorEnv(2, max_episode_steps=3, autoreset_mode=mode, **PARTS)
    calls = []
    vector.before_autoreset.append(lambda mask: calls.append((mask.tolist(), vector.robot.joint_positions.copy())))
    vector.after_reset.append(lambda mask: calls.append("reset"))
    vector.reset(seed=0)
    vector.step(np.ones((2, 6)))
    vector.reset(options={"reset_mask": np.array([True, False])})  # the second episode ends first
    for _ in range(2):
        observation, _, _, truncated, info = vector.step(np.ones((2, 6)))
    assert truncated.tolist() == [False, True]
    last = info["final_obs"][1] if mode == "SameStep" else observation[1]
    if mode == "NextStep":
        assert calls == ["reset", "reset"]
        vector.step(np.ones((2, 6)))
    assert (calls[:2], calls[3]) == (["reset", "reset"], "reset")
    mask, positions = calls[2]
    assert mask == [False, True]
    assert positions[1] == pytest.approx(last[:6], abs=1e-6)
    vector.close()


def test_call_after_reset_is_deprecated(vector):
    called = []
    with pytest.warns(FrobsDeprecationWarning, match=r"after_reset\.append"):
        vector.call_after_reset(called.append)
    vector.reset(seed=0)
    assert called == [None]


@pytest.mark.needs("rendering")
def test_pictures_are_of_the_size_that_was_asked_for():
    env = RobotVectorEnv(2, render_mode="rgb_array", render_size=(32, 48), **PARTS)
    env.reset(seed=0)
    pictures = env.render()
    assert [picture.shape for picture in pictures] == [(32, 48, 3)] * 2
    env.close()
    silent = RobotEnv(**PARTS)
    silent.reset(seed=0)
    assert silent.render() is None
    silent.close()


class Telling(Controller):
    """Holds the robot, and tells how often it was asked in the episode."""

    command_mode = CommandMode.POSITION
    action_shape = (1,)

    def bind_scene(self, scene, simulation):
        self.seen = scene, simulation

    def bind(self, robot, control_timestep, decimation):
        assert self.seen[1].robots["robot"] is robot
        self.robot, self.control_timestep = robot, control_timestep
        self.action_space = gym.spaces.Box(-1.0, 1.0, self.action_shape, np.float32)
        self.asked = np.zeros(robot.num_envs)

    def reset(self, mask):
        self.asked[slice(None) if mask is None else mask] = 0.0

    def apply(self, action):
        self.asked += 1.0
        return self.robot.home

    def info(self):
        return {"asked": self.asked}


TELLING = ControllerRecord(
    name="telling", summary="", entry_point=f"{__name__}:{Telling.__name__}", control_timestep=0.1
)


@pytest.fixture
def telling(monkeypatch):
    monkeypatch.setattr(ControllerRecord, "load", lambda record: Telling)
    return {**PARTS, "controller": TELLING}


@pytest.mark.parametrize("shape", [(), (2, 2), (2, 3)])
def test_the_action_of_the_only_controller_may_have_any_shape(telling, monkeypatch, shape):
    monkeypatch.setattr(Telling, "action_shape", shape)
    with closing(RobotEnv(**telling)) as env:
        env.reset(seed=0)
        env.step(np.ones(shape))
        assert (env.step_context.raw_action == np.ones((1, *shape))).all()
        with pytest.raises(InvalidActionError, match="non-finite"):
            env.step(np.full(shape, np.nan))


def test_what_a_controller_tells_is_in_the_info(telling):
    with closing(RobotEnv(**telling)) as env:
        env.reset(seed=0)
        env.step(np.zeros(1))
        assert env.step(np.zeros(1))[-1]["frobs/asked"] == 2.0


def test_what_a_controller_tells_of_an_ended_episode_is_in_the_final_info(telling):
    with closing(RobotVectorEnv(3, max_episode_steps=2, **telling)) as env:
        env.reset(seed=0)
        info = env.step(np.zeros((3, 1)))[-1]
        assert info["frobs/asked"].tolist() == [1.0] * 3
        assert info["_frobs/asked"].all()
        info = env.step(np.zeros((3, 1)))[-1]
        assert info["final_info"]["frobs/asked"].tolist() == [2.0] * 3  # not 0, although the controller was reset since
        assert info["final_info"]["_frobs/asked"].all()
        assert not info["_frobs/asked"].any()


def test_a_controller_may_say_how_long_its_steps_are(telling):
    with closing(RobotEnv(**telling)) as env:
        assert env.control_timestep == env.controller.control_timestep == 0.1
    with closing(RobotEnv(**telling, control_timestep=0.02)) as env:
        assert env.control_timestep == 0.02
    with closing(RobotEnv(**telling, control_timestep=4.0)) as env:
        assert env.metadata["render_fps"] == 1  # Gymnasium cannot write a video with 0 frames per second


def test_a_controller_that_tells_nothing_is_not_asked(env, monkeypatch):
    monkeypatch.setattr(Controller, "info", lambda self: pytest.fail("asked"))
    env.reset(seed=0)
    env.step(env.action_space.sample())
