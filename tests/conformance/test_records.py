"""The conformance kit over every record and every plugin that is installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import pytest

from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_devkit.testing import (
    Check,
    check_algorithm,
    check_controller,
    check_env,
    check_plugin,
    check_robot,
    check_simulator,
    check_task,
    pytest_checks,
)

_ON_POLICY = {"n_steps": 64, "batch_size": 32, "n_epochs": 2}
_OFF_POLICY = {"learning_starts": 60, "batch_size": 16, "buffer_size": 1000, "policy_kwargs": {"net_arch": [64, 64]}}

SHORT: dict[str, dict[str, Any]] = {
    "ppo": _ON_POLICY,
    "recurrent_ppo": {**_ON_POLICY, "policy_kwargs": {"lstm_hidden_size": 16}},
    **dict.fromkeys(("ddpg", "sac", "td3", "tqc", "crossq"), _OFF_POLICY),
    "dqn": {**_OFF_POLICY, "learning_rate": 0.01},
}
SHORT |= {"rllib_ppo": _ON_POLICY, "rllib_sac": _OFF_POLICY, "rllib_appo": {"n_steps": 16, "batch_size": 32}}
SHORT |= {f"sbx_{name}": SHORT[name] for name in ("ppo", "sac", "td3", "tqc", "crossq", "dqn")}
"""Settings with which a training of a few hundred steps has several iterations."""

QUICK = ("dqn-", "ppo-", "td3-")
"""Algorithms of the quick tests: on-policy, off-policy, and with discrete actions."""

IMITATING = {"act", "bc", "dagger"}
"""Algorithms that need a demonstrator, which the environments of the kit do not have. The tests of
frobs-algos-imitation check resuming, saving, memory and the exported graph of these algorithms."""

# PyBullet has no wheel for a Python above 3.11; what needs it cannot be checked there.
MISSING = set() if find_spec("pybullet") else {"pybullet", "sim_pybullet"}
MISSING |= {"gazebo", "sim_gazebo"}  # most machines lack it: its own tests check it, and say why where they cannot
MISSING |= {"ros", "ros2", "safe"}  # paced: they need a robot, or another simulation; their own tests check them
if not all(find_spec(name) for name in ("ompl", "pinocchio", "toppra")):
    MISSING |= {"trajectory", "controllers_planning"}


def every(kind: str, check: Callable[[str], list[Check]]) -> Iterator[Check]:
    for name in [name for name in plugins.records(kind) if name not in MISSING]:
        yield from (replace(one, name=f"{name}-{one.name}") for one in check(name))


def on_gazebo(name: str) -> list[Check]:
    return [check for check in check_robot(name, ["gazebo"]) if check.name.startswith("gazebo.")]


def of_a_task_alone(name: str) -> list[Check]:
    """Return the checks that test_environment_ids.py has not run on the ID of the task."""
    if not plugins.get_record("task", name).environments:  # type: ignore[attr-defined]
        return check_task(name, robot="irb120", controller="joint_delta_position")
    done = {check.name for check in check_env("")}
    return [check for check in check_task(name) if check.name not in done]


test_simulator = pytest_checks(every("simulator", check_simulator))
SIMULATORS = [name for name in plugins.records("simulator") if name not in MISSING]
test_robot = pytest_checks(every("robot", lambda name: check_robot(name, SIMULATORS)), allow_inconclusive=False)
LACKS = {
    "suction_cup-gazebo.sensors_read": "the sensor of the suction cup is force_torque, which Gazebo does not offer"
}
test_robot_on_gazebo = pytest.mark.needs("gazebo")(
    pytest.mark.slow(pytest_checks(every("robot", on_gazebo), expected_failures=LACKS, allow_inconclusive=False))
)
test_controller = pytest_checks(every("controller", check_controller))
test_task = pytest_checks(every("task", of_a_task_alone))
ALGORITHMS = list(every("algorithm", lambda name: [] if name in IMITATING else check_algorithm(name, SHORT.get(name))))
test_algorithm = pytest_checks(check for check in ALGORITHMS if check.name.startswith(QUICK))
test_other_algorithm = pytest.mark.slow(
    pytest_checks(check for check in ALGORITHMS if not check.name.startswith(QUICK))
)
test_plugin = pytest_checks(
    replace(check, name=f"{report.name}-{check.name}")
    for report in plugins.reports()
    if report.name not in MISSING
    for check in check_plugin(report.name)
)


def test_every_task_has_an_id_that_is_checked() -> None:
    checked = {record.name for record, _ in registry.environments().values()}
    assert set(plugins.records("task")) - checked == {"reach_together"}  # of two robots, which an ID does not choose
