"""The conformance kit over every ID that is registered."""

from __future__ import annotations

from dataclasses import replace

from frobs_core import registry
from frobs_core.testing import check_env, pytest_checks

# full_range actions are joint positions in radians, as FRobs_RL sent them: both checkers warn of that
_LEGACY = "its actions are joint positions in [rad], which the checkers recommend to normalise"

test_environment = pytest_checks(
    [replace(check, name=f"{id}-{check.name}") for id in registry.environments() for check in check_env(id)],
    expected_failures={
        "frobs/Irb120ReachLegacy-v0-gymnasium_checker": _LEGACY,
        "frobs/Irb120ReachLegacy-v0-stable_baselines3_checker": _LEGACY,
    },
)
