from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import Any

import pytest
import ray

from frobs_ray.cluster import connect
from frobs_ray.errors import ClusterConnectionError

FOREIGN = "import sys, ray; ray.init(sys.argv[1]); print(ray.cluster_resources())"


@ray.remote
def _double(number: int) -> int:
    return 2 * number


@pytest.mark.slow
def test_a_local_cluster_ends_with_the_block_and_prints_nothing(capfd: Any) -> None:
    handler, variables = signal.getsignal(signal.SIGTERM), dict(os.environ)
    for _ in range(2):  # a process can start several, one after the other
        with connect(num_cpus=1):
            assert ray.get(_double.remote(21)) == 42
            assert signal.getsignal(signal.SIGTERM) == handler
        assert not ray.is_initialized()
    assert dict(os.environ) == variables
    assert signal.getsignal(signal.SIGTERM) == handler
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_an_open_connection_is_used_and_stays_open() -> None:
    with connect(num_cpus=1):
        with connect("127.0.0.1:1"):
            assert ray.get(_double.remote(1)) == 2
        assert ray.is_initialized()


@pytest.mark.slow
def test_a_process_without_the_token_is_refused() -> None:
    with connect(num_cpus=1):
        address = ray.get_runtime_context().gcs_address
        environment = {**os.environ, "RAY_AUTH_TOKEN": "0" * 64, "RAY_gcs_rpc_server_reconnect_timeout_s": "1"}
        foreign = subprocess.run(
            [sys.executable, "-c", FOREIGN, address], env=environment, capture_output=True, text=True, check=False
        )
    assert foreign.returncode != 0
    assert "InvalidAuthToken" in foreign.stderr


@pytest.mark.parametrize("address", ["127.0.0.1:1", "no-such-host.invalid:6379", "ray://127.0.0.1:1", "127.0.0.1"])
def test_an_address_without_a_cluster_is_named(address: str) -> None:
    message = f"cannot connect to the Ray cluster at '{address}'.*ray start"
    with pytest.raises(ClusterConnectionError, match=message), connect(address):
        pass


def test_an_algorithm_of_rllib_names_a_cluster_that_does_not_answer(make: Any, monitor: Any) -> None:
    algorithm = make("rllib_ppo", {"num_env_runners": 1, "ray_address": "127.0.0.1:1"})
    with pytest.raises(ClusterConnectionError, match=r"cannot connect to the Ray cluster at '127\.0\.0\.1:1'"):
        algorithm.train(32, monitor)
