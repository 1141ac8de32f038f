"""Names and keywords of version 0.2 that have another name now."""

from __future__ import annotations

from contextlib import closing
from importlib import import_module

import gymnasium as gym
import numpy as np
import pytest

from frobs_cli.errors import CommandLineError
from frobs_core import contracts
from frobs_core.deprecation import MOVED, FrobsDeprecationWarning, moved_names, rename_keywords
from frobs_core.kernel.config import EnvConfig
from frobs_core.plugins.records import CapabilityRecord, ParameterRecord


@pytest.fixture(autouse=True)
def lenient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let deprecated parts be used, as for users."""
    monkeypatch.delenv("FROBS_DEPRECATIONS")


def test_every_public_module_of_0_2_can_be_imported() -> None:
    for module in MOVED:
        __import__(module)


def test_a_moved_name_is_the_same_object_and_says_its_place() -> None:
    with pytest.warns(FrobsDeprecationWarning, match=r"use frobs_core\.util\.errors\.FrobsError"):
        from frobs_core.errors import FrobsError
    from frobs_core.util.errors import FrobsError as Moved

    assert FrobsError is Moved


@pytest.mark.parametrize("module", ["frobs_core.errors", "frobs_core.util.errors"])
def test_an_error_of_commands_is_found_in_its_distribution(module: str) -> None:
    with pytest.warns(FrobsDeprecationWarning) as warnings:
        error = import_module(module).CommandLineError
    assert error is CommandLineError
    assert [f"use frobs_cli.errors.{error.__name__}." in str(one.message) for one in warnings] == [True]


def test_the_argument_of_a_command_line_error_has_its_name_of_0_2() -> None:
    error = CommandLineError("--size", "too large")
    with pytest.warns(FrobsDeprecationWarning, match=r"use CommandLineError\.place"):
        assert error.argument == "--size"
    assert str(error) == "--size: too large"


def test_names_are_exported_without_those_of_distributions_that_are_not_installed() -> None:
    assert moved_names("of_0_2", ["not_installed.errors", "frobs_core.contracts"])("__all__") == contracts.__all__
    with pytest.raises(AttributeError, match="__all__"):
        moved_names("of_0_2", ["not_installed.errors"])("__all__")


def test_a_renamed_class_is_found_under_its_name_of_0_2() -> None:
    with pytest.warns(FrobsDeprecationWarning, match=r"use frobs_core\.plugins\.records\.CapabilityRecord"):
        from frobs_core.specs import AbilityRecord

    assert AbilityRecord is CapabilityRecord


def test_names_that_never_existed_are_not_found() -> None:
    with pytest.raises(ImportError, match="nothing_like_this"):
        from frobs_core.errors import nothing_like_this  # noqa: F401
    with pytest.raises(ModuleNotFoundError):
        import frobs_core.nothing_like_this  # noqa: F401


@pytest.mark.filterwarnings("error")
def test_a_program_whose_warnings_are_errors_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    assert rename_keywords({"robot_args": {"a": "1"}}, {"robot_args": "xacro_args"}) == {"xacro_args": {"a": "1"}}
    assert "use 'xacro_args'" in caplog.text


def test_the_keyword_robot_args_is_read() -> None:
    with pytest.warns(FrobsDeprecationWarning, match="'robot_args'"):
        config = EnvConfig.from_dict({"task": "reach", "robot": "irb120", "robot_args": {"prefix": "a"}})
    assert config.xacro_args == {"prefix": "a"}
    with pytest.warns(FrobsDeprecationWarning, match="'robot_args'"):
        two = EnvConfig(task="t", robots={"left": {"robot": "irb120", "robot_args": {"a": "1"}}}).robot_configs()
    assert two["left"].xacro_args == {"a": "1"}


def test_a_parameter_may_name_its_capability_as_in_0_2() -> None:
    with pytest.warns(FrobsDeprecationWarning, match="'capability'"):
        assert ParameterRecord(name="wind", summary="s", ability="wind").capability == "wind"


def test_the_raw_action_has_its_name_of_0_2_too() -> None:
    with closing(gym.make("frobs_core:frobs/Irb120Reach-v0").unwrapped) as env:
        env.reset(seed=0)
        action = env.action_space.sample()
        env.step(action)
        with pytest.warns(FrobsDeprecationWarning, match=r"use StepContext\.raw_action"):
            assert np.array_equal(env.step_context.given_action[0], action)
