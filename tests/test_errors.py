from __future__ import annotations

import pickle

import numpy as np
import pytest

from frobs_core.errors import (
    ConfigurationError,
    MissingSettingError,
    ParameterValueError,
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
