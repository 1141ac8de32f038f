"""The tests of the torch family's contract, with the algorithms in JAX; the fixture ``family`` selects them."""

from __future__ import annotations

import pytest
from test_sb3_off_policy import (  # noqa: F401
    test_a_policy_that_only_predicts_needs_no_replay_buffer,
    test_dqn_tells_how_much_it_explores,
    test_hindsight_replay_is_the_default_where_the_reward_of_another_goal_can_be_asked_for,
    test_hindsight_replay_waits_for_the_first_episodes,
    test_more_or_fewer_environments_than_in_the_training_are_refused,
    test_only_what_is_due_is_told,
    test_settings_that_do_not_go_with_the_environment_are_refused,
    test_whole_episodes_can_be_collected_between_rounds_of_learning,
)
from test_sb3_ppo import (  # noqa: F401
    test_a_bad_setting_is_named,
    test_a_damaged_file_is_named,
    test_a_file_that_would_execute_code_is_refused,
    test_another_environment_is_refused,
    test_continuing_equals_never_having_stopped,
    test_one_thread_by_default,
    test_rows_and_offers_come_at_the_start_of_each_rollout,
    test_settings_resolve_to_the_same_again,
    test_spaces_that_cannot_be_used_are_refused,
    test_the_algorithm_leaves_the_environment_its_seed,
    test_the_monitor_can_end_it,
    test_the_scale_that_a_task_suggests_is_part_of_the_policy,
    test_what_is_loaded_predicts_the_same,
)

pytestmark = pytest.mark.slow  # each network is compiled
