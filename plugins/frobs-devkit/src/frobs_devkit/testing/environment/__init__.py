"""Checks of an environment ID: this project's own, or any of Gymnasium's."""

from __future__ import annotations

import re
from typing import Any

from frobs_devkit.testing.checks import Check, Inconclusive, checks_of, collect, only
from frobs_devkit.testing.environment import (
    api,
    data,
    honesty,
    life,
    pictures,
    randomization,
    rewards,
    seeding,
    state,
    vector,
)
from frobs_devkit.testing.environment.subject import EnvUnderTest

CHECKS = checks_of(data, seeding, api, life, honesty, rewards, state, vector, randomization, pictures)
"""Every check of an environment, in the order in which they run."""

SKELETON = re.compile(r"Skeleton-v[0-9]+$")
"""End of the IDs whose task ``frobs migrate`` could not translate."""


def check_env(id: str, **kwargs: Any) -> list[Check]:
    """Return the checks of an environment ID.

    Nothing is made until a check runs. What only this project's environments have (``snapshot``, reward terms, …) is
    not applicable to others. For an ID that ends in ``Skeleton-v0``, an inconclusive check reports that its task is a
    stand-in.

    Args:
        id: A Gymnasium ID, also in the self-importing form ``"frobs_core:frobs/Irb120Reach-v0"``.
        **kwargs: Keywords of the environment: ``simulator=``, ``controller=``, …
    """
    checks = collect(EnvUnderTest(id, kwargs), CHECKS)
    if SKELETON.search(id):
        reason = Inconclusive(
            "the task is a stand-in that 'frobs migrate' made; complete it as MIGRATION.md says, and rename it"
        )
        checks += only("task_is_complete", "The task is the one that the ID names, not a skeleton.", reason)
    return checks
