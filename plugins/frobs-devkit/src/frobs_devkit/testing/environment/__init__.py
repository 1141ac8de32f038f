"""Conformance checks for the environments of FRobs and other packages."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from typing import Any

from frobs_core.util.errors import CapabilityError
from frobs_devkit.testing.checks import Check, Inconclusive, NotApplicable, checks_in, collect, only
from frobs_devkit.testing.environment.under_test import EnvUnderTest

CHECKS = checks_in(
    __name__,
    "outputs seeding api lifecycle step_results rewards success vector randomization",
)
"""All environment checks, in the order in which they run."""

SKELETON = re.compile(r"Skeleton-v[0-9]+$")
"""Pattern for the IDs of environments whose task is a placeholder that ``frobs migrate`` wrote."""


def check_env(id: str, **kwargs: Any) -> list[Check]:
    """Return the conformance checks for an environment ID.

    No environment is created until a check runs. Checks of FRobs-specific features, such as ``snapshot`` and reward
    terms, do not apply to environments of other packages. If the ID ends in ``Skeleton-v0``, an additional inconclusive
    check reports that the environment's task is only a placeholder.

    Args:
        id: A Gymnasium ID, optionally with a module to import, as in ``"frobs_core:frobs/Irb120Reach-v0"``.
        **kwargs: Keyword arguments of the environment, such as ``simulator=`` and ``controller=``.
    """
    checks = collect(EnvUnderTest(id, kwargs), map(_if_able, CHECKS))
    if SKELETON.search(id):
        reason = Inconclusive(
            "the task is a placeholder that 'frobs migrate' created; complete the task as described in MIGRATION.md, "
            "and rename it"
        )
        checks += only("task_is_complete", "The task is complete, not a skeleton.", reason)
    return checks


def _if_able(function: Callable[[EnvUnderTest], None]) -> Callable[[EnvUnderTest], None]:
    @wraps(function)
    def check(subject: EnvUnderTest) -> None:
        try:
            function(subject)
        except CapabilityError as error:
            claimed = subject.simulator.capabilities if subject.simulator else {}
            lacking = [capability for _, capability, *_ in error.missing if not claimed.get(capability)]
            if not lacking:
                raise
            raise NotApplicable(f"the simulator does not claim '{', '.join(lacking)}'") from error

    return check
