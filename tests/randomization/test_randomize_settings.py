from __future__ import annotations

import numpy as np
import pytest

from frobs_core.sensing.randomization import read_settings
from frobs_core.sensing.randomization.draw import Schedule
from frobs_core.util.errors import ConfigFileError, ConfigurationError, UnknownParameterError
from frobs_core.util.random import RandomSource
from frobs_core.util.yaml import load_yaml_text


def only(given: object, parameter: str = "mass"):
    (item,) = read_settings({parameter: given}).items
    return item


def draw(given: object, width: int = 4000) -> np.ndarray:
    source = RandomSource(1)
    source.seed([1])
    source.begin_episode()
    return only(given).distribution.draw(source, "x", width, None)[0]


def test_nothing_is_read_from_nothing():
    assert read_settings(None) is None
    assert read_settings({}) is None


def test_what_is_drawn_is_distributed_as_it_was_written():
    uniform = draw({"scale": [0.8, 1.2]})
    assert 0.8 <= uniform.min() < 0.81 < 1.19 < uniform.max() < 1.2
    normal = draw({"scale": {"normal": 0.1}})
    assert normal.mean() == pytest.approx(1.0, abs=0.01)
    assert normal.std() == pytest.approx(0.1, rel=0.05)
    assert draw({"add": {"normal": 0.1}}).mean() == pytest.approx(0.0, abs=0.01)
    assert draw({"set": {"normal": 0.1, "mean": 3.0}}).mean() == pytest.approx(3.0, abs=0.01)
    bounded = draw({"add": {"normal": 1.0, "bounds": [-0.5, 2.0]}})
    assert (bounded.min(), bounded.max()) == (-0.5, 2.0)
    logs = np.log(draw({"scale": {"log_uniform": [0.1, 10.0]}}))
    assert abs(logs).max() <= np.log(10.0)
    assert logs.mean() == pytest.approx(0.0, abs=0.1)
    assert set(draw({"scale": 1.2}).tolist()) == {1.2}


def test_times_are_read():
    assert only({"scale": 1.2}).schedule == Schedule(when="reset")
    assert only({"scale": 1.2, "when": "start"}).schedule == Schedule(when="start")
    assert only({"scale": 1.2, "when": "step"}).schedule == Schedule(when="interval", interval=(1, 1))
    assert only({"scale": 1.2, "every": 25}).schedule == Schedule(when="interval", interval=(25, 25))
    seconds = only({"scale": 1.2, "every": {"seconds": [0.2, 1.0]}}).schedule
    assert seconds.steps(0.04, "here") == (5, 25)
    with pytest.raises(
        ConfigurationError, match=r"an interval of 0\.2 s is not a whole number of control steps of 0\.03 s"
    ):
        seconds.steps(0.03, "here")
    assert only({"x": {"normal": 1}}, "observation_noise").schedule == Schedule(when="interval", interval=(1, 1))


def test_a_list_and_its_only_member_mean_the_same():
    assert only([{"scale": 1.2}]).stream == only({"scale": 1.2}).stream == "mass/0"
    streams = [item.stream for item in read_settings({"mass": [{"scale": 1.2}, {"add": 1}]}).items]
    assert streams == ["mass/0", "mass/1"]


def test_delays_are_whole_steps_with_both_ends():
    distribution = only({"steps": [0, 2]}, "action_delay").distribution
    assert (distribution.shape, float(distribution.low), float(distribution.high)) == ("uniform", 0.0, 2.0)
    assert float(only({"steps": 3}, "observation_delay").distribution.low) == 3.0


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        ({"masss": {"scale": 1.1}}, UnknownParameterError, "randomize has no parameter 'masss'. Did you mean 'mass'"),
        (
            {"mass": {"scal": 1.1}},
            UnknownParameterError,
            "randomize.mass has no parameter 'scal'. Did you mean 'scale'",
        ),
        ({"gravity": {"target": "x", "add": 1}}, UnknownParameterError, "randomize.gravity has no parameter 'target'"),
        (
            {"mass": {"target": "*"}},
            ConfigurationError,
            "randomize.mass: expected exactly one of the keys scale, add, set",
        ),
        ({"mass": {"scale": 1, "add": 1}}, ConfigurationError, "exactly one of"),
        (
            {"mass": 1.1},
            ConfigurationError,
            r"randomize.mass: expected a mapping such as \{scale: \[0.8, 1.2\]\}.*got 1.1",
        ),
        ({"mass": []}, ConfigurationError, "randomize.mass: the list is empty"),
        (
            {"mass": [{"scale": 1}, {"scale": "x"}]},
            ConfigurationError,
            r"randomize.mass\[1\]: scale is 'x'; it must be a valid number",
        ),
        (
            {"mass": {"scale": [1.2, 0.8]}},
            ConfigurationError,
            r"randomize.mass: scale = \[1.2, 0.8\]: the lowest value exceeds",
        ),
        ({"mass": {"scale": [1, 2, 3]}}, ConfigurationError, r"scale = \[1, 2, 3\]: write a range \[lowest, highest\]"),
        ({"mass": {"scale": [[1, 2], [3]]}}, ConfigurationError, "have different lengths"),
        ({"mass": {"scale": float("nan")}}, ConfigurationError, "scale is nan; it must be a finite number"),
        ({"mass": {"scale": True}}, ConfigurationError, "scale is True; it must be a valid number"),
        ({"mass": {"scale": {"nromal": 1}}}, UnknownParameterError, "Did you mean 'normal'"),
        ({"mass": {"scale": {"normal": -1}}}, ConfigurationError, "must not be negative"),
        ({"mass": {"set": {"normal": 1}}}, ConfigurationError, "requires a mean"),
        (
            {"mass": {"scale": {"uniform": [1, 2], "bounds": [1, 2]}}},
            ConfigurationError,
            "scale = .*: the distribution 'uniform' accepts neither mean nor bounds; only 'normal' does",
        ),
        ({"mass": {"scale": {"log_uniform": [0, 2]}}}, ConfigurationError, "above 0"),
        (
            {"mass": {"scale": 1, "when": "often"}},
            ConfigurationError,
            "when is 'often'; it must be 'start', 'reset' or 'step'",
        ),
        ({"mass": {"scale": 1, "when": "start", "every": 3}}, ConfigurationError, "cannot be combined"),
        ({"mass": {"scale": 1, "every": 0.5}}, ConfigurationError, "a whole number of control steps ≥ 1"),
        (
            {"mass": {"scale": 1, "every": {"minutes": 1}}},
            UnknownParameterError,
            "'every' of randomize.mass .* Available: seconds, steps",
        ),
        ({"mass": {"scale": 1, "target": []}}, ConfigurationError, r"target = \[\]: List should have at least 1 item"),
        ({"mass": {"scale": 1, "shared": "no"}}, ConfigurationError, "shared is 'no'; it must be a valid boolean"),
        (
            {"action_delay": {"steps": 0.5}},
            ConfigurationError,
            "randomize.action_delay: steps is 0.5; it must be a valid integer",
        ),
        (
            {"action_delay": {"steps": [2, 1]}},
            ConfigurationError,
            r"steps = \[2, 1\]: the lowest value exceeds the highest",
        ),
        ({"action_delay": {"when": "start"}}, ConfigurationError, "randomize.action_delay needs steps"),
        ({"action_delay": [{"steps": 1}, {"steps": 2}]}, ConfigurationError, "an action has only one delay"),
        ({"action_delay": {"steps": 5000}}, ConfigurationError, "steps is 5000; it must be less than or equal to 1000"),
        (
            {"observation_noise": {"normal": 0.1}},
            ConfigurationError,
            "observation_noise.normal: expected a mapping.*, got 0.1",
        ),
        (
            {"observation_noise": {"x": {"when": "step"}}},
            ConfigurationError,
            "expected exactly one of the keys constant",
        ),
        ([1], ConfigurationError, r"expected a mapping.*, got \[1\]"),
    ],
)
def test_bad_input_is_named(given, error, says):
    with pytest.raises(error, match=says):
        read_settings(given)


def test_a_file_is_named_with_its_line():
    text = "randomize:\n  mass: {scale: [0.8, 1.2]}\n  gravity:\n    add: [2, 1]\n"
    with pytest.raises(ConfigFileError, match=r"my\.yaml:4: randomize\.gravity: add = \[2, 1\]"):
        read_settings(load_yaml_text(text, "my.yaml")["randomize"])


def test_the_name_of_a_noisy_term_may_contain_slashes():
    [setting] = read_settings({"observation_noise": {"left/joint_positions": {"normal": 0.1}}}).items
    assert setting.targets == ("left/joint_positions",)
