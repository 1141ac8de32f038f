"""Checks of an environment ID: this project's own, or any of Gymnasium's."""

from __future__ import annotations

from typing import Any

from frobs_devkit.testing.checks import Check, collect
from frobs_devkit.testing.environment import (
    api,
    data,
    honesty,
    life,
    pictures,
    randomization,
    rewards,
    seeding,
    sensors,
    state,
    vector,
)
from frobs_devkit.testing.environment.subject import EnvUnderTest

CHECKS = (
    api.gymnasium_checker,
    api.stable_baselines3_checker,
    api.spec_pickles,
    api.close_twice,
    api.unknown_keyword_refused,
    api.fresh_process,
    data.spaces_hold,
    data.values_finite,
    data.observations_share_no_memory,
    data.observation_elements_vary,
    seeding.same_seed_repeats,
    seeding.seeds_differ,
    seeding.episodes_differ,
    seeding.reset_forgets_history,
    life.time_advances,
    life.step_needs_reset,
    life.bad_actions_refused,
    life.reset_options_hold,
    honesty.step_shows_its_action,
    honesty.ends_have_their_reason,
    honesty.info_keys_have_their_prefix,
    rewards.success_in_every_step,
    rewards.terms_sum_to_reward,
    rewards.compute_reward_equals_step,
    state.snapshot_continues,
    vector.same_step_equals_single,
    vector.next_step_equals_single,
    vector.disabled_equals_single,
    vector.threads_agree,
    randomization.randomized_equals_single,
    randomization.randomized_state_is_complete,
    sensors.sensors_may_be_bad,
    pictures.render_draws,
)
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
