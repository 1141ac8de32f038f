import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from typer.testing import Result

from frobs_devkit.testing import Check, CheckFailure, Inconclusive, NotApplicable, find

Frobs = Callable[..., Result]


def _fail() -> None:
    raise CheckFailure("expected [0, 1], was 2")


def _crash() -> None:
    raise ZeroDivisionError("by zero")


def _see_nothing() -> None:
    raise Inconclusive("no episode ended")


def _decline() -> None:
    raise NotApplicable("no goal")


PASSES = Check("it_holds", "It holds.", lambda: None)
INCONCLUSIVE = Check("it_saw_nothing", "It saw nothing.", _see_nothing)
OTHER = Check("it_is_not_meant", "It is not meant.", _decline)
FAILS = Check("it_breaks", "It breaks.", _fail)
CRASHES = Check("it_crashes", "It crashes.", _crash)


@pytest.fixture
def checks(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Put other checks in the place of the kit's."""

    def put(*found: Check) -> None:
        monkeypatch.setattr(find, "check_env", lambda _: list(found))

    return put


def test_all_is_well(frobs: Frobs, checks: Callable[..., None]) -> None:
    checks(PASSES, INCONCLUSIVE, OTHER)
    result = frobs("check", "CartPole-v1")
    assert result.exit_code == 0
    assert "✓ it holds" in result.stdout
    assert "○ it saw nothing" in result.stdout
    assert "no episode ended" in result.stdout
    assert (
        "warning: some checks were inconclusive because the situation they test did not occur: it_saw_nothing"
        in result.stdout
    )
    assert "on python 3" in result.stdout
    assert result.stdout.splitlines()[-1] == "1 passed, 1 inconclusive, 1 not applicable"


def test_a_failure_is_shown_and_the_others_go_on(frobs: Frobs, checks: Callable[..., None]) -> None:
    checks(FAILS, CRASHES, PASSES)
    result = frobs("check", "CartPole-v1")
    assert result.exit_code == 1
    assert result.stderr == ""
    assert "✗ it breaks" in result.stdout
    assert "    expected [0, 1], was 2" in result.stdout
    assert "    ZeroDivisionError: by zero" in result.stdout
    assert result.stdout.splitlines()[-1] == "1 passed, 2 failed"


def test_json_has_every_check(frobs: Frobs, checks: Callable[..., None]) -> None:
    checks(FAILS, PASSES)
    result = frobs("check", "CartPole-v1", "--json")
    found: dict[str, Any] = json.loads(result.stdout)
    assert result.exit_code == 1
    assert (found["id"], found["ok"]) == ("CartPole-v1", False)
    assert [(check["name"], check["status"]) for check in found["checks"]] == [
        ("it_breaks", "failed"),
        ("it_holds", "passed"),
    ]


def test_an_expected_failure_is_no_failure(frobs: Frobs, checks: Callable[..., None]) -> None:
    checks(FAILS, PASSES)
    result = frobs("check", "CartPole-v1", "--expect-failure", "it_breaks=not yet")
    assert result.exit_code == 0
    assert "not yet: expected [0, 1], was 2" in result.stdout
    passes = frobs("check", "CartPole-v1", "--expect-failure", "it_holds=a rumour")
    assert passes.exit_code == 1
    assert "the check passes, but was expected to fail: a rumour" in passes.stdout


def test_the_module_that_registers_an_id_is_imported(
    frobs: Frobs, checks: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in ``frobs train``. The module is also found if its name resembles a kind of part."""
    (tmp_path / "my_robot.py").write_text(
        "import gymnasium\nif 'Mine-v0' not in gymnasium.registry:\n"
        "    gymnasium.register('Mine-v0', 'gymnasium.envs.classic_control:CartPoleEnv')\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(gym.registry, "Mine-v0", raising=False)
    checks(PASSES)
    assert "1 passed" in frobs("check", "my_robot:Mine-v0").stdout
    assert gym.registry.pop("Mine-v0").id == "Mine-v0"


def test_a_robot_is_checked_by_its_name(frobs: Frobs) -> None:
    result = frobs("check", "robot:irb120", "--simulator", "mujoco")
    assert result.exit_code == 0
    assert "mujoco.home_is_held" in result.stdout


def test_a_plugin_is_checked_with_its_parts(frobs: Frobs) -> None:
    result = frobs("check", "frobs-robots-abb", "--simulator", "mujoco", "--json")
    found: dict[str, Any] = json.loads(result.stdout)
    assert result.exit_code == 0
    assert found["kind"] == "distribution"
    assert "robots_abb.robot:irb120.mujoco.frames_agree" in [check["name"] for check in found["checks"]]


def test_capabilities_are_told_with_their_level(
    frobs: Frobs, checks: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    drives = Check("drives", "They drive.", lambda: None, capability="drive")
    monkeypatch.setattr(find, "check_simulator", lambda _: [drives])
    text = frobs("check", "simulator:mujoco").stdout
    assert "verified: drive (exact)" in text
    assert "claimed, not verified: determinism" in text
    facts = json.loads(frobs("check", "simulator:mujoco", "--json").stdout)
    assert facts["verified_capabilities"] == ["drive"]
    assert facts["claimed_capabilities"]["rays"] == "exact"


@pytest.mark.parametrize(("given", "told"), [("it_breaks", "CHECK=REASON"), ("it_braks=x", "Did you mean 'it_breaks'")])
def test_a_bad_expectation_is_refused(frobs: Frobs, checks: Callable[..., None], given: str, told: str) -> None:
    checks(FAILS)
    result = frobs("check", "CartPole-v1", "--expect-failure", given)
    assert result.exit_code == 2
    assert told in result.stderr


def test_settings_and_steps_reach_the_checks(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[object] = []

    def check_algorithm(name: str, config: object, **keywords: object) -> list[Check]:
        given.extend([name, config, keywords])
        return [PASSES]

    monkeypatch.setattr(find, "check_algorithm", check_algorithm)
    settings = ["--set", "algorithm_config.gamma=0.9", "--set", "algorithm_config.policy_kwargs.net_arch=[8]"]
    assert frobs("check", "algorithm:ppo", *settings, "--steps", "50").exit_code == 0
    assert given == ["ppo", {"gamma": 0.9, "policy_kwargs": {"net_arch": [8]}}, {"steps": 50}]


@pytest.mark.parametrize(
    ("word", "right"),
    [
        ("algorithm:ppo", "algorithm_config.learning_rate"),
        ("frobs/Irb120Reach-v0", "environment_kwargs.learning_rate"),
        ("controller:joint_position", "environment_kwargs.controller_kwargs.learning_rate"),
        ("sensor_type:lidar", "environment_kwargs.sensors.lidar.learning_rate"),
    ],
)
def test_a_setting_has_the_same_form_as_in_a_run_configuration(frobs: Frobs, word: str, right: str) -> None:
    result = frobs("check", word, "--set", "learning_rate=0.1")
    assert result.exit_code == 2
    assert f"write --set {right}=VALUE" in result.stderr


@pytest.mark.parametrize(("word", "option"), [("irb120", ("--set", "a=1")), ("frobs/Irb120Reach-v0", ("--steps", "5"))])
def test_options_that_mean_nothing_are_refused(frobs: Frobs, word: str, option: tuple[str, str]) -> None:
    result = frobs("check", word, *option)
    assert result.exit_code == 2
    assert option[0] in result.stderr


def test_json_stays_clean_when_a_check_prints(frobs: Frobs, checks: Callable[..., None]) -> None:
    checks(Check("it_prints", "It prints.", lambda: print("hello")))  # noqa: T201
    result = frobs("check", "CartPole-v1", "--json")
    assert json.loads(result.stdout)["ok"]
