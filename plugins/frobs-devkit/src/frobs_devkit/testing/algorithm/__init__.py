"""Conformance checks for an algorithm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins.records import AlgorithmRecord
from frobs_devkit.testing.algorithm import baseline_task, learning, saving
from frobs_devkit.testing.algorithm.under_test import ENVIRONMENTS, AlgorithmUnderTest
from frobs_devkit.testing.checks import Check, NotApplicable, checks_of, collect, only

CHECKS = checks_of(learning, baseline_task, saving)
"""All algorithm checks, in the order in which they run."""


def check_algorithm(
    algorithm: str | AlgorithmRecord, config: Mapping[str, Any] | None = None, id: str | None = None, steps: int = 300
) -> list[Check]:
    """Return the conformance checks for an algorithm.

    Args:
        algorithm: Name of an installed algorithm, or the record of an algorithm that is not installed yet.
        config: Settings for a short training run.
        id: Environment ID for the checks. Defaults to a small Gymnasium environment that suits the algorithm.
        steps: Number of environment steps in a training run.

    Raises:
        UnknownNameError: The algorithm does not exist.
    """
    record = find_record(AlgorithmRecord, algorithm)
    chosen = id or next((ENVIRONMENTS[kind] for kind in record.action_spaces if kind in ENVIRONMENTS), "")
    if not chosen:
        spaces = ", ".join(record.action_spaces)
        none = NotApplicable(
            f"the conformance kit has no environment with the action space {spaces}; pass an environment ID as id= "
            "to check_algorithm"
        )
        return only("environment_is_given", "An environment is given.", none)
    return collect(AlgorithmUnderTest(record, chosen, config or {}, steps), CHECKS)
