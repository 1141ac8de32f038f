"""Training goes on while nodes come and go."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import ray
from ray.cluster_utils import Cluster
from ray.rllib.core.learner.training_data import TrainingData

from frobs_ray.rllib.on_policy import _APPOLearner

pytestmark = pytest.mark.slow

STORE = 100 * 2**20


@pytest.fixture
def nodes(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A cluster of which this process is the driver; its head node runs nothing."""
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")
    monkeypatch.setenv("RAY_ENABLE_UV_RUN_RUNTIME_ENV", "0")
    monkeypatch.setenv("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    before = dict(os.environ)
    cluster = Cluster(
        initialize_head=True,
        head_node_args={"num_cpus": 0, "include_dashboard": False, "object_store_memory": STORE},
    )
    yield cluster
    ray.shutdown()
    cluster.shutdown()
    for name in set(os.environ) - set(before):
        del os.environ[name]


@pytest.mark.parametrize("name", ["rllib_ppo", "rllib_appo"])
def test_training_continues_when_a_node_is_lost_and_another_joins(
    name: str, nodes: Any, make: Any, monitor: Any, caplog: Any
) -> None:
    workers = [nodes.add_node(num_cpus=1, object_store_memory=STORE) for _ in range(2)]
    replaced = False

    def replace_a_node(steps: int) -> None:
        nonlocal replaced
        if steps >= 400 and not replaced:
            replaced = True
            nodes.remove_node(workers[0], allow_graceful=False)
            nodes.add_node(num_cpus=1, object_store_memory=STORE)

    monitor.on_row = replace_a_node
    monitor.is_enough = lambda steps: "All 2 environment runners work again" in caplog.text
    algorithm = make(name, {"num_env_runners": 2, "n_steps": 25, "ray_address": nodes.address})
    algorithm.train(200_000, monitor)
    assert replaced
    assert algorithm.steps < 200_000
    assert monitor.rows[-1][0] == algorithm.steps
    lengths = np.concatenate([item["lengths"] for item in monitor.episodes])
    # What is missing are the running episodes, once when the node was lost and once at the end.
    assert algorithm.steps - 2 * 4 * 50 <= lengths.sum() <= algorithm.steps
    assert "1 of 2 environment runners work." in caplog.text


@ray.remote(num_cpus=1)
class _Sampler:
    """Owns what it samples, as an environment runner does."""

    def sample(self) -> list[Any]:
        return [ray.put(["a fragment"])]


def test_a_batch_of_which_every_fragment_was_lost_causes_no_gradient_step(nodes: Any) -> None:
    worker = nodes.add_node(num_cpus=1, object_store_memory=STORE)
    ray.init(address=nodes.address)
    fragments = ray.get(_Sampler.remote().sample.remote())
    nodes.remove_node(worker, allow_graceful=False)
    lost = TrainingData(episodes_refs=fragments)
    learner = object.__new__(_APPOLearner)
    assert learner.update(lost, timesteps={}) == {}
    assert lost.episodes == []
