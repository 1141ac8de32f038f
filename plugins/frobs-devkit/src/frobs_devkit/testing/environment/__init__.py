"""Checks of an environment ID: this project's own, or any of Gymnasium's."""

from __future__ import annotations

from typing import Any

from frobs_devkit.testing.checks import Check, checks_of, collect
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


def check_env(id: str, **kwargs: Any) -> list[Check]:
    """Return the checks of an environment ID.

    Nothing is made until a check runs. What only this project's environments have (``snapshot``, reward terms, …) is
    not applicable to others.

    Args:
        id: A Gymnasium ID, also in the self-importing form ``"frobs_core:frobs/Irb120Reach-v0"``.
        **kwargs: Keywords of the environment: ``simulator=``, ``controller=``, …
    """
    return collect(EnvUnderTest(id, kwargs), CHECKS)
