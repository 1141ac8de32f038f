"""The conformance kit over every ID that is registered."""

from __future__ import annotations

from dataclasses import replace

from frobs_core import registry
from frobs_core.testing import check_env, pytest_checks

test_environment = pytest_checks(
    [replace(check, name=f"{id}-{check.name}") for id in registry.environments() for check in check_env(id)],
)
