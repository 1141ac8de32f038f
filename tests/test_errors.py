from __future__ import annotations

import pickle

import numpy as np
import pytest

from frobs_core.util.errors import (
    ConfigurationError,
    MissingSettingError,
    ParameterValueError,
    ResetOptionError,
    SceneError,
    SettingError,
    UnknownNameError,
    UnknownParameterError,
)


@pytest.mark.parametrize(
    "error",
    [
        ConfigurationError("text"),
        ParameterValueError("steps", -1, "at least 1", "task 'reach'"),
        UnknownNameError("robot", "irb", ["irb120"], failed=["acme"]),
        UnknownParameterError("task 'reach'", "goal", ["goals"]),
    ],
    ids=lambda error: type(error).__name__,
)
def test_a_pickled_error_keeps_class_text_and_fields(error):
    restored = pickle.loads(pickle.dumps(error))
    assert type(restored) is type(error)
    assert str(restored) == str(error)
    assert vars(restored) == vars(error)


def test_a_value_error_names_owner_parameter_value_and_rule():
    error = ParameterValueError("steps", np.int64(-1), "at least 1", "task 'reach'")
    assert str(error) == "task 'reach': steps is -1; it must be at least 1."


def test_an_owner_and_an_advice_can_be_omitted():
    assert str(ParameterValueError("steps", "many", "a number")) == "steps is 'many'; it must be a number."
    assert str(MissingSettingError("task 'reach'", "a robot")) == "task 'reach' needs a robot."


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (SettingError("sensors.imu", "remove it."), "sensors.imu: remove it."),
        (ResetOptionError("goal", "is 'far'."), "reset option 'goal' is 'far'."),
        (SceneError("contact 'grip'", "refers to {x}."), "contact 'grip' refers to {x}."),
    ],
)
def test_an_error_of_a_setting_names_its_place_and_the_reason(error, text):
    assert isinstance(error, SettingError)
    assert str(pickle.loads(pickle.dumps(error))) == text


def test_an_unknown_name_lists_the_five_nearest_of_many():
    names = [f"robot{i}" for i in range(9)] + ["irb120", "irb140"]
    text = str(UnknownNameError("robot", "irb12", names))
    assert text.startswith("no robot is named 'irb12'. Did you mean 'irb120'? Available: irb120, irb140, ")
    assert text.endswith(" and 6 more: frobs list robots.")
    assert text.count("robot") == 3 + 2  # "no robot", three of them, and the command
    assert len(UnknownNameError("robot", "irb12", names).available) == 11
    assert str(UnknownNameError("body", "x", "abcdef")).endswith(" and 1 more.")


def test_an_unknown_parameter_lists_all():
    assert "a, b, c, d, e, f, g" in str(UnknownParameterError("task 'reach'", "x", "abcdefg"))
