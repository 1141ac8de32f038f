"""What holds of an environment, whatever is randomised in it."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import frobs_core.plugins
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.util.errors import CapabilityError, ConfigurationError, UnknownNameError

EVERYTHING = {
    "mass": [{"scale": [0.8, 1.2]}, {"target": "link_6", "add": [0.0, 0.5], "when": "start"}],
    "friction": {"set": {"log_uniform": [0.3, 1.2]}},
    "stiffness": {"scale": {"normal": 0.1}},
    "damping": {"scale": [0.8, 1.2], "shared": True, "when": "start"},
    "joint_damping": {"add": [0.0, 0.5], "every": 4},
    "gravity": {"add": {"normal": 0.05}, "every": [2, 5]},
    "action_delay": {"steps": [0, 2]},
    "observation_noise": {
        "joint_positions": [{"normal": 0.005}, {"uniform": [-0.01, 0.01], "when": "start"}],
        "goal*": {"uniform": [-0.01, 0.01]},
    },
    "observation_delay": [{"steps": [0, 1]}, {"steps": [0, 2], "target": "tcp_position", "when": "step"}],
}


def test_an_environment_without_it_has_none(make):
    env = make(2)
    assert env.randomization is None
    assert env.reset(seed=0)[1] == {}
    assert make(2, {}).randomization is None
    assert not any(name.startswith("randomization/") for name in env.snapshot())


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_the_vector_is_the_single_environment_over_episode_ends(make, actions, mode):
    n, length, played = 3, 7, actions(30, 3)
    env = make(n, EVERYTHING, max_episode_steps=length, autoreset_mode=mode)
    single = make(None, EVERYTHING)
    together = [env.reset(seed=5)]
    together += [env.step(action)[:2] for action in played]
    for i in range(n):
        expected, info = single.reset(seed=5 + i)
        assert (together[0][0][i] == expected).all()
        told = together[0][1]["frobs/randomization"]
        assert all((told[name][i] == value).all() for name, value in info["frobs/randomization"].items())
        k = 0
        for number, action in enumerate(played, start=1):
            if mode == "NextStep" and k == length:  # its action does not count
                expected, k = single.reset()[0], 0
            else:
                expected, reward, *_ = single.step(action[i])
                k += 1
                assert together[number][1][i] == reward
                if mode == "SameStep" and k == length:
                    expected, k = single.reset()[0], 0
            assert (together[number][0][i] == expected).all(), (number, i)


def test_a_snapshot_continues_with_the_same_bits_in_a_new_environment(make, actions):
    env = make(3, EVERYTHING, max_episode_steps=9)
    played = actions(40, 3)
    env.reset(seed=0)
    for action in played[:13]:
        env.step(action)
    kept = {name: array.copy() for name, array in env.snapshot().items()}
    assert all(len(array) == 3 for array in kept.values())
    values = env.randomization.values
    first = [env.step(action)[0] for action in played[13:]]
    for again in (env, make(3, EVERYTHING, max_episode_steps=9)):
        again.restore(kept)
        assert all((again.randomization.values[name] == value).all() for name, value in values.items())
        for name, value in again.randomization.values.items():
            parameter, _, target = name.partition("/")
            if parameter == "mass":
                assert (again.simulation.parameter(parameter, target) == value).all()
        assert all((again.step(a)[0] == b).all() for a, b in zip(played[13:], first, strict=True))


def test_a_snapshot_of_another_randomisation_is_refused(make):
    env, other = make(1, {"mass": {"scale": [0.8, 1.2]}}), make(1, {"gravity": {"scale": [0.8, 1.2]}})
    env.reset(seed=0)
    other.reset(seed=0)
    with pytest.raises(ConfigurationError, match="taken with different randomization settings"):
        other.restore(env.snapshot())


def values_over(env, steps, **reset):
    env.reset(**reset)
    found = [env.randomization.values]
    for _ in range(steps):
        env.step(np.zeros(env.action_space.shape))
        found.append(env.randomization.values)
    (name,) = found[0]
    return [value[name].copy() for value in found]


def test_start_reset_and_intervals_draw_when_they_say(make):
    scale = {"target": "link_3", "scale": [0.8, 1.2]}
    env = make(2, {"mass": {**scale, "when": "start"}})
    first = values_over(env, 3, seed=0)
    assert all((each == first[0]).all() for each in (*first, *values_over(env, 3)))  # over episodes too
    assert (values_over(env, 0, seed=9)[0] != first[0]).all()
    assert (values_over(env, 0, seed=0)[0] == first[0]).all()

    env = make(2, {"mass": scale})
    first = values_over(env, 3, seed=0)
    assert all((each == first[0]).all() for each in first)
    assert (values_over(env, 0)[0] != first[0]).all()

    for every, changes in ((3, [3, 6]), ({"seconds": 0.08}, [2, 4, 6, 8])):
        found = values_over(make(2, {"mass": {**scale, "every": every}}), 8, seed=0)
        assert [k for k in range(1, 9) if (found[k] != found[k - 1]).all()] == changes
        assert [k for k in range(1, 9) if (found[k] != found[k - 1]).any()] == changes

    found = np.array(values_over(make(6, {"mass": {**scale, "every": [2, 4]}}), 40, seed=0))
    changed = found[1:] != found[:-1]
    gaps = np.concatenate([np.diff(np.flatnonzero(column)) for column in changed.T])
    assert set(gaps.tolist()) == {2, 3, 4}
    assert not changed.all(axis=1).any()  # each environment at times of its own


def test_a_masked_reset_changes_only_the_environments_of_the_mask(make):
    env = make(3, {"mass": {"target": "link_3", "scale": [0.8, 1.2]}})
    env.reset(seed=0)
    before = env.simulation.parameter("mass", "robot/link_3").copy()
    _, info = env.reset(options={"reset_mask": np.array([True, False, False])})
    after = env.simulation.parameter("mass", "robot/link_3")
    assert (after != before).tolist() == [True, False, False]
    assert info["_frobs/randomization"].tolist() == [True, False, False]


def test_settings_do_not_disturb_each_other(make):
    """Nor the task: goals are those of the nominal environment."""
    plain, one, all_of_it = make(2), make(2, {"mass": {"scale": [0.8, 1.2]}}), make(2, EVERYTHING)
    for env in (plain, one, all_of_it):
        env.reset(seed=0)
    assert (plain.task.goal == all_of_it.task.goal).all()
    name = "mass/robot/link_3"
    assert (one.randomization.values[name] == all_of_it.randomization.values[name]).all()


def test_settings_are_applied_one_after_the_other(make):
    env = make(1, {"mass": [{"target": "link_3", "scale": 2.0}, {"target": "robot/link_3", "add": 0.5}]})
    env.reset(seed=0)
    assert env.simulation.parameter("mass", "robot/link_3") == pytest.approx([2 * 2.944 + 0.5])


def test_gymnasium_makes_it():
    settings = {"gravity": {"scale": 0.5}}
    env = gym.make("frobs_core:frobs/Irb120Reach-v0", randomize=settings)
    assert env.reset(seed=0)[1]["frobs/randomization"]["gravity"] == pytest.approx([0, 0, -4.905])
    assert env.unwrapped.randomization.settings == settings
    env.close()
    envs = gym.make_vec(
        "frobs_core:frobs/Irb120Reach-v0", 2, vectorization_mode="vector_entry_point", randomize=settings
    )
    assert envs.reset(seed=0)[1]["frobs/randomization"]["gravity"].shape == (2, 3)
    envs.close()


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        (
            {"mass": {"target": "link_9", "scale": 1.1}},
            UnknownNameError,
            "no target of randomize.mass is named 'link_9'",
        ),
        ({"stiffness": {"target": "joint1", "scale": 1.1}}, UnknownNameError, "Did you mean 'robot/joint_1'"),
        ({"mass": {"target": "tool0", "scale": 1.1}}, UnknownNameError, "tool0"),  # it has no mass
        (
            {"mass": {"scale": [-0.1, 1]}},
            ConfigurationError,
            "could become -0.6215, which is below 1% of the nominal mass",
        ),
        (
            {"mass": {"target": "link_6", "add": [-1, 1]}},
            ConfigurationError,
            "link_6, whose nominal value is 0.137, could become",
        ),
        ({"damping": {"scale": [-1, 1]}}, ConfigurationError, "below 0"),
        (
            {"joint_damping": {"scale": [1, 2]}},
            ConfigurationError,
            "is 0, so scale has no effect; use add or set",
        ),
        (
            {"mass": {"scale": [[1, 1], [2, 2]]}},
            ConfigurationError,
            "a bound has 2 numbers; for each bound, write one number",
        ),
        ({"gravity": {"add": [[1, 1], [2, 2]]}}, ConfigurationError, "three numbers for x, y and z"),
        (
            {"gravity": {"scale": 1.0, "every": {"seconds": 0.05}}},
            ConfigurationError,
            r"^randomize\.gravity: an interval of 0\.05 s .* 0\.04 s would work",
        ),
        ({"size": {"scale": 1.1}}, ConfigurationError, "this environment has nothing whose size can be changed"),
        ({"camera_fov": {"scale": [0.01, 1.0]}}, ConfigurationError, "could become 0.4.*, which is below 1; narrow"),
        ({"camera_fov": {"add": [0, 200]}}, ConfigurationError, "could become 24.*, which is above 170; narrow"),
        ({"texture": {"set": [0, 65]}}, ConfigurationError, "could become 65, which is above 64"),
        ({"distractors": {"set": 9}}, ConfigurationError, r"could become 9, which is above 8\.999999"),
        ({"light": {"add": -2}}, ConfigurationError, "could become -1, which is below 0"),
        ({"color": {"target": "x", "set": 1}}, UnknownNameError, "Available: floor, robot/base_link, robot/link_1, "),
    ],
)
def test_what_does_not_fit_the_model_is_refused(make, given, error, says):
    with pytest.raises(error, match=says):
        make(2, given)


def test_what_would_change_nothing_is_refused(make):
    for controller in ("joint_velocity", "joint_effort"):
        with pytest.raises(ConfigurationError, match=r"randomize\.stiffness: this setting has no effect"):
            make(2, {"stiffness": {"scale": 1.1}}, controller=controller)
    mixed = {"robot": "irb120+parallel_gripper", "controller": {"arm": "joint_velocity", "gripper": "gripper_delta"}}
    with pytest.raises(ConfigurationError, match=r"randomize\.stiffness\[1\]: this setting has no effect"):
        make(2, {"stiffness": [{"scale": 1.1}, {"target": "joint_*", "scale": 1.1}]}, **mixed)


def test_an_unbounded_distribution_is_held_above_zero(make):
    env = make(64, {"mass": {"scale": {"normal": 1.0}}, "damping": {"add": {"normal": 1000.0}}})
    env.reset(seed=0)
    values = env.randomization.values
    assert values["mass/robot/link_3"].min() == pytest.approx(0.01 * 2.944)
    assert values["damping/robot/joint_1"].min() == 0.0


def test_an_unbounded_distribution_is_held_inside_the_limits_of_the_looks(make):
    env = make(64, {"camera_fov": {"add": {"normal": 500.0}}, "light": {"scale": {"normal": 2.0}}})
    env.reset(seed=0)
    (fov, *_), lights = (
        [v for k, v in env.randomization.values.items() if k.startswith(p)] for p in ("camera", "light")
    )
    assert (fov.min(), fov.max()) == (1.0, 170.0)
    assert min(map(np.min, lights)) == 0.0


def test_a_simulator_that_cannot_is_refused_before_it_is_built(make, monkeypatch):
    able = {"drive": Level.EXACT, "teleport": Level.EXACT, "randomize_friction": Level.APPROXIMATE}
    poor = SimulatorRecord(name="poor", summary="", entry_point="nowhere:Nothing", capabilities=able)
    known = frobs_core.plugins.get_record
    monkeypatch.setattr(
        frobs_core.plugins, "get_record", lambda kind, name: poor if name == "poor" else known(kind, name)
    )
    with pytest.raises(CapabilityError) as caught:
        make(2, EVERYTHING, simulator="poor")
    assert [row[:2] for row in caught.value.missing] == [
        ("randomize.mass", "randomize_mass"),
        ("randomize.stiffness", "randomize_gains"),
        ("randomize.damping", "randomize_gains"),
        ("randomize.joint_damping", "randomize_joint_damping"),
        ("randomize.gravity", "randomize_gravity"),
    ]


def test_a_refused_action_counts_no_step(make):
    env = make(None, {"observation_noise": {"*": {"normal": 0.01}}})
    env.reset(seed=0)
    expected = env.step(np.zeros(6))[0]
    env.reset(seed=0)
    with pytest.raises(Exception, match="contains non-finite values"):
        env.step(np.full(6, np.nan))
    assert (env.step(np.zeros(6))[0] == expected).all()
