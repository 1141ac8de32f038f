"""The tests of demonstrations of the torch family, with the algorithms in JAX; the fixture ``family`` selects them."""

from __future__ import annotations

import pytest
from test_sb3_demonstrations import (  # noqa: F401
    data_set,
    run_env,
    test_checkpoints_share_the_file_of_the_demonstrations,
    test_continuing_changes_no_bit,
    test_half_of_each_batch_are_demonstrations,
    test_hindsight_replay_can_be_combined_with_demonstrations,
    test_the_networks_start_from_the_initial_policy,
)

pytestmark = pytest.mark.slow  # each network is compiled
