"""The conformance kit over every ID that is registered, and over combinations that none of them has."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import pytest

from frobs_core.plugins import registry
from frobs_core.plugins.registry import COMPOSITIONAL_ID
from frobs_devkit.testing import Check, check_env, pytest_checks

SHORTER = {"control_timestep": 0.1}
"""Of the legacy IDs, whose control steps are long: the laws are the same in a fifth of the time."""

ROBOTS = {id: record.robot for id, (_, record) in registry.environments().items()}
BATCHES = ("same_step_equals_single", "snapshot_continues", "threads_agree", "spaces_hold")
ON_PYBULLET = ("spaces_hold", "same_seed_repeats", "reset_forgets_history", "snapshot_continues", "render_draws")
_ROBOTS = {"frobs/Reach-v0": "irb120", "frobs/Navigate-v0": "kobuki"}
"""Robots of the IDs that leave the robot open. The others need an arm with a gripper."""

WORKERS = ("same_step_equals_single", "threads_agree", "randomized_equals_single")
"""Those that start worker processes on PyBullet, each for a few seconds: for one ID only."""

QUICK = ("frobs/Irb120Reach-v0", "frobs/KobukiDynamic-v0")
"""An arm and a mobile robot, which are checked in the quick tests."""

LONG = ("same_step_equals_single", "disabled_equals_single", "randomized_equals_single", "randomized_state_is_complete")
"""Checks that take seconds; in the quick tests only for the arm."""


def named(prefix: str, id: str, only: tuple[str, ...] = (), **keywords: Any) -> Iterator[Check]:
    for check in check_env(id, **keywords):
        if not only or check.name in only:
            yield replace(check, name=f"{prefix}-{check.name}")


def composed(controller: str, *only: str) -> Iterator[Check]:
    yield from named(
        f"{COMPOSITIONAL_ID}-{controller}", COMPOSITIONAL_ID, only, robot="irb120", task="reach", controller=controller
    )


def keywords_of(id: str, robot: str) -> dict[str, Any]:
    standing_in = {} if robot else {"robot": _ROBOTS.get(id, "panda")}
    return {**standing_in, **(SHORTER if "Legacy" in id else {})}


def by_check(checks: Iterable[Check]) -> list[Check]:
    """Return the checks of several IDs, check after check: each eighth of them then has almost every check."""
    return sorted(checks, key=lambda check: check.name.rpartition("-")[2])


def of(ids: Iterable[str]) -> Iterator[Check]:
    for id in ids:
        yield from named(id, id, **keywords_of(id, ROBOTS[id]))


def on_pybullet(ids: Iterable[str], only: tuple[str, ...] = ON_PYBULLET, **keywords: Any) -> Iterator[Check]:
    if find_spec("pybullet") is not None:  # which has no wheel for a Python above 3.11
        for id in ids:
            both = {"simulator": "pybullet", **keywords_of(id, ROBOTS[id]), **keywords}
            yield from named(f"pybullet-{id}", id, only, **both)


def is_long(check: Check) -> bool:
    id, _, name = check.name.rpartition("-")
    return id != QUICK[0] and name in LONG


OTHERS = [id for id in ROBOTS if id not in QUICK]

test_environment = pytest_checks(check for check in of(QUICK) if not is_long(check))
test_environment_at_length = pytest.mark.slow(pytest_checks(filter(is_long, of(QUICK))))
test_all_other_environments = pytest.mark.slow(pytest_checks(by_check(of(OTHERS))))
test_on_pybullet = pytest_checks(on_pybullet(QUICK, num_threads=1))
test_workers_on_pybullet = pytest.mark.slow(pytest_checks(on_pybullet(QUICK[:1], WORKERS)))
test_all_others_on_pybullet = pytest.mark.slow(pytest_checks(by_check(on_pybullet(OTHERS, num_threads=1))))
test_composed_with_discrete_actions = pytest_checks(composed("discrete", "spaces_hold", "snapshot_continues"))
test_composed_with_discrete_actions_in_full = pytest.mark.slow(pytest_checks(composed("discrete")))
test_composed_with_tool_actions = pytest_checks(composed("tcp_delta_pose", *BATCHES))
test_composed_with_velocities = pytest_checks(composed("joint_velocity", *BATCHES))
