"""Vector environments on several simulators."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from frobs_core import load_policy
from frobs_core.kernel.mixed_vector_env import MixedVectorEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import (
    ConfigurationError,
    InvalidActionError,
    ParameterValueError,
    ResetNeededError,
    ResetOptionError,
    SimulationError,
    UnknownNameError,
)

pytestmark = pytest.mark.needs("pybullet")

ID = "frobs_core:frobs/Irb120Reach-v0"
NUM_ENVS = {"mujoco": 3, "pybullet": 2}
ROWS = {"mujoco": slice(0, 3), "pybullet": slice(3, 5)}
RANDOMIZE = {
    "mass": {"scale": [0.8, 1.2]},
    "action_delay": {"steps": [0, 2]},
    "observation_noise": {"joint_positions": {"normal": 0.01}},
}
KEYWORDS = {"max_episode_steps": 6, "stagger": True, "randomize": RANDOMIZE, "num_threads": 1}

Make = Callable[..., Any]


def rows_of(value: Any, rows: slice) -> Any:
    """Return rows of the arrays in tuples and dictionaries. Values that a mask excludes become None, or are left out."""
    if isinstance(value, tuple):
        return tuple(rows_of(item, rows) for item in value)
    if not isinstance(value, dict):
        return value[rows]
    found = {}
    for key, item in value.items():
        mask = value.get(f"_{key}")
        part = rows_of(item, rows)
        if mask is None or isinstance(part, dict):
            found[key] = part
        elif mask[rows].any():
            found[key] = [each if shown else None for each, shown in zip(part, mask[rows], strict=True)]
    is_empty = {key: not np.any(item) if key.startswith("_") else repr(item) == "{}" for key, item in found.items()}
    return {key: item for key, item in found.items() if not is_empty[key]}


def expect_equal(actual: Any, expected: Any) -> None:
    with np.printoptions(threshold=10_000, floatmode="unique"):  # so that the representation of an array is exact
        assert repr(actual) == repr(expected)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_rows_equal_those_of_each_simulator_alone_bit_for_bit(make: Make, mode: AutoresetMode) -> None:
    mixed = make(ID, NUM_ENVS, autoreset_mode=mode, **KEYWORDS)
    alone = {name: make(ID, count, simulator=name, autoreset_mode=mode, **KEYWORDS) for name, count in NUM_ENVS.items()}
    mixed.action_space.seed(1)
    first = mixed.reset(seed=7)
    assert "frobs/randomization" in first[1]
    for name, env in alone.items():
        expect_equal(rows_of(first, ROWS[name]), rows_of(env.reset(seed=7 + ROWS[name].start), slice(None)))
    ended = dict.fromkeys(alone, False)
    for _ in range(5 if mode is AutoresetMode.DISABLED else 16):
        actions = mixed.action_space.sample()
        result = mixed.step(actions)
        for name, env in alone.items():
            own = env.step(actions[ROWS[name]])
            expect_equal(rows_of(result, ROWS[name]), rows_of(own, slice(None)))
            done = own[2] | own[3]
            ended[name] |= bool(done.any())
            if mode is AutoresetMode.SAME_STEP and done.any():
                final = mixed.unwrapped.final_observation[ROWS[name]]
                expect_equal(final[done], env.unwrapped.final_observation[done])
        if mode is AutoresetMode.DISABLED and (result[2] | result[3]).any():
            break
    assert mode is AutoresetMode.DISABLED or all(ended.values())


def test_some_environments_are_reset_with_their_own_seeds_and_options(make: Make) -> None:
    mixed = make(ID, NUM_ENVS, autoreset_mode=AutoresetMode.DISABLED)
    pybullet = make(ID, 2, simulator="pybullet", autoreset_mode=AutoresetMode.DISABLED)
    mixed.reset(seed=3)
    before = mixed.step(np.full(mixed.action_space.shape, 0.5))[0]
    goals = np.linspace([0.3, -0.2, 0.3], [0.4, 0.2, 0.5], 5)
    mask = np.array([False, False, False, False, True])
    chosen = {"goal": goals, "reset_mask": mask}
    seen, _ = mixed.reset(seed=[None, None, None, None, 11], options=chosen)
    assert np.array_equal(seen[:4], before[:4])
    own, _ = pybullet.reset(seed=[10, 11], options={"goal": goals[3:]})
    assert np.array_equal(seen[4], own[1])
    everywhere, _ = mixed.reset(seed=3, options={"goal": goals[0]})
    goal = everywhere[:, mixed.unwrapped.observations.columns["goal"][1]]
    assert np.array_equal(goal, np.tile(goals[0].astype(np.float32), (5, 1)))
    for broken in ({"goal": goals[:4]}, {"reset_mask": mask[:4]}):
        with pytest.raises(ResetOptionError):
            mixed.reset(options=broken)
    with pytest.raises(ParameterValueError, match="number of seeds"):
        mixed.reset(seed=[1, 2])


def test_a_part_that_no_mask_has_selected_is_seeded_by_the_first_reset(make: Make) -> None:
    masked, other = make(ID, NUM_ENVS), make(ID, NUM_ENVS)
    masked.reset(seed=5, options={"reset_mask": np.array([True] * 3 + [False] * 2)})
    later, _ = masked.reset(options={"reset_mask": np.array([False] * 3 + [True] * 2)})
    assert np.array_equal(later, other.reset(seed=5)[0])


def test_a_restored_snapshot_continues_exactly(make: Make) -> None:
    one, two = make(ID, NUM_ENVS, **KEYWORDS), make(ID, NUM_ENVS, **KEYWORDS)
    one.action_space.seed(2)
    one.reset(seed=0)
    one.step(one.action_space.sample())
    two.unwrapped.restore(one.unwrapped.snapshot())
    for _ in range(8):
        action = one.action_space.sample()
        assert np.array_equal(one.step(action)[0], two.step(action)[0])


def test_a_wrong_action_moves_no_robot(make: Make) -> None:
    env = make(ID, NUM_ENVS)
    with pytest.raises(ResetNeededError, match=r"environments \[0, 1, 2, 3, 4\]"):
        env.step(env.action_space.sample())
    env.reset(seed=0)
    before = env.unwrapped.snapshot()
    actions = np.zeros(env.action_space.shape)
    actions[4, 0] = np.nan
    with pytest.raises(InvalidActionError, match=r"indices \[\[4, 0\]\]"):
        env.step(actions)
    after = env.unwrapped.snapshot()
    assert all(np.array_equal(before[name], after[name]) for name in before)


def test_the_failure_of_one_engine_names_its_simulator(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make(ID, NUM_ENVS)
    env.reset(seed=0)

    def fail(steps: int) -> None:
        raise SimulationError("the engine stopped.")

    monkeypatch.setattr(env.unwrapped.parts["pybullet"].simulation, "step", fail)
    with pytest.raises(SimulationError, match="simulator 'pybullet': the engine stopped"):
        env.step(env.action_space.sample())


def test_all_simulations_are_closed_if_one_cannot_be_built(monkeypatch: pytest.MonkeyPatch) -> None:
    closed = []
    build, close = RobotVectorEnv.__init__, RobotVectorEnv.close_extras

    def fail_on_pybullet(self: Any, count: int, **keywords: Any) -> None:
        if keywords["simulator"] == "pybullet":
            raise SimulationError("no memory")
        build(self, count, **keywords)

    def count_closing(self: Any, **_: Any) -> None:
        closed.append(self.config.simulator)
        close(self)

    monkeypatch.setattr(RobotVectorEnv, "__init__", fail_on_pybullet)
    monkeypatch.setattr(RobotVectorEnv, "close_extras", count_closing)
    with pytest.raises(SimulationError, match="no memory"):
        gym.make_vec(ID, NUM_ENVS)
    assert closed == ["mujoco"]
    with pytest.raises(UnknownNameError, match="havok"):
        gym.make_vec(ID, {"mujoco": 1, "havok": 1})


@pytest.mark.parametrize(
    ("num_envs", "keywords", "message"),
    [
        ({}, {}, "num_envs is {}"),
        ({"mujoco": 0}, {}, "num_envs.mujoco is 0"),
        ({"mujoco": 2, "ros2": 1}, {}, "simulators that are not paced, unlike 'ros2'"),
        ({"mujoco": 1}, {"render_mode": "human"}, "render_mode is 'human'"),
    ],
)
def test_what_several_simulators_cannot_do_is_an_error(num_envs: Any, keywords: Any, message: str) -> None:
    with pytest.raises(ParameterValueError, match=message):
        gym.make_vec(ID, num_envs, **keywords)


def test_different_spaces_are_an_error_that_names_the_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    build = RobotVectorEnv.__init__

    def with_another_term(self: Any, count: int, **keywords: Any) -> None:
        observed = {"speed": {"type": "joint_efforts"}}
        build(self, count, **keywords, **({"observations": observed} if keywords["simulator"] == "pybullet" else {}))

    monkeypatch.setattr(RobotVectorEnv, "__init__", with_another_term)
    with pytest.raises(ConfigurationError, match="'mujoco' and 'pybullet' differ in their observation terms speed"):
        gym.make_vec(ID, NUM_ENVS)


def test_an_expert_acts_on_every_simulator(make: Make) -> None:
    id = "frobs_core:frobs/PandaPush-v0"
    mixed, start = make(id, {"mujoco": 2, "pybullet": 1}), np.ones(3, bool)
    alone = make(id, 1, simulator="pybullet")
    policy, own = load_policy("expert", mixed), load_policy("expert", alone)
    seen, seen_alone = mixed.reset(seed=0)[0], alone.reset(seed=2)[0]
    for _ in range(5):
        action, action_alone = policy.act(seen, start), own.act(seen_alone, start[2:])
        assert np.array_equal(action[2:], action_alone)
        seen, seen_alone = mixed.step(action)[0], alone.step(action_alone)[0]
        start = np.zeros(3, bool)
    assert all(len(values) == 3 for values in policy.info().values())
    policy.close()


def test_terms_and_copies(make: Make) -> None:
    env = make(ID, NUM_ENVS)
    observation, _ = env.reset(seed=0)
    assert env.unwrapped.read_terms({"tool": {"type": "tcp_pose"}})["tool"].shape == (5, 7)
    twin = copy.deepcopy(env.unwrapped)
    assert isinstance(twin, MixedVectorEnv)
    assert np.array_equal(twin.reset(seed=0)[0], observation)
    twin.close()
