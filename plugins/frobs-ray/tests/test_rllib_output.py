"""What training prints, and the cluster that it starts."""

from __future__ import annotations

from typing import Any

import pytest
import ray


@pytest.mark.slow
def test_training_prints_nothing_and_stops_the_cluster_that_it_started(make: Any, monitor: Any, capfd: Any) -> None:
    make("rllib_ppo").train(32, monitor)
    assert not ray.is_initialized()
    assert capfd.readouterr() == ("", "")
